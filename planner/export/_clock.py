"""From seconds of the campaign to the laboratory's wall clock."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo, available_timezones

from planner.errors import InputError
from planner.nouns.plan_file import PlanDocument
from planner.protocols import ExportOptions
from planner.quantities import WEEKDAYS
from planner.spec.places import did_you_mean

# Fixed, because the same plan must give the same bytes: a Monday morning.
DEFAULT_START = "2027-01-04T08:00"
DEFAULT_TIMEZONE = "Europe/Berlin"


@dataclass(frozen=True)
class WallClock:
    """The moment at which second 0 of the campaign falls, in the laboratory's time zone."""

    start: datetime

    def at(self, seconds: float) -> datetime:
        """Local time `seconds` later; elapsed seconds, also over a change to summer time."""
        moment = self.start.astimezone(UTC) + timedelta(seconds=round(seconds))
        return moment.astimezone(self.start.tzinfo)


def started_with_the_plan(options: ExportOptions, plan: PlanDocument) -> ExportOptions:
    """Where the user gives no start: the date, or the weekday, and time from which the shifts were laid."""
    if options.start is not None or plan.start is None:
        return options
    day, time = plan.start.split()
    monday = datetime.fromisoformat(DEFAULT_START)
    date = plan.first_day or (monday + timedelta(days=WEEKDAYS.index(day))).date()
    return replace(options, start=f"{date.isoformat()}T{time}")


def wall_clock(options: ExportOptions) -> WallClock:
    """Raises InputError for an unknown zone, a time that cannot be read or that the clocks skip."""
    zone = _zone(options.timezone or DEFAULT_TIMEZONE)
    text = options.start or DEFAULT_START
    try:
        start = datetime.fromisoformat(text)
    except ValueError as error:
        raise InputError(f"--start {text!r} is no time; write it like 2026-12-01T08:00") from error
    if not 1980 <= start.year <= 2200:
        raise InputError(f"--start {text!r} is in no year that a campaign could start in")
    if start.tzinfo is not None:
        return WallClock(start.astimezone(zone))
    local = start.replace(tzinfo=zone)
    if local.astimezone(UTC).astimezone(zone).replace(tzinfo=None) != start:
        raise InputError(f"--start {text!r} does not exist in {zone.key}: the clocks are put forward over it")
    return WallClock(local)


def _zone(name: str) -> ZoneInfo:
    known = available_timezones()
    if name in known:
        return ZoneInfo(name)
    raise InputError(f"unknown time zone {name!r}{did_you_mean(name, known) or '; write Europe/Berlin'}")


def time_text(moment: datetime) -> str:
    """A moment for people: `Mon 2027-01-04 08:00`, in English whatever the locale."""
    day = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")[moment.weekday()]
    return f"{day} {moment:%Y-%m-%d %H:%M}"


def elapsed_text(seconds: float) -> str:
    """Seconds of the campaign as `hours:minutes:seconds`."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"
