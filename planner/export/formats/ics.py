"""The attended steps as appointments (RFC 5545, with the time zone's definition), and the operator sheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, date
from typing import TYPE_CHECKING, Any

from planner.export._attended import HandTask, attendances
from planner.export._checked import checked_plan
from planner.export._clock import (
    DEFAULT_START,
    DEFAULT_TIMEZONE,
    WallClock,
    elapsed_text,
    started_with_the_plan,
    wall_clock,
)
from planner.export._shifts import checked_hours
from planner.export.header import header
from planner.export.operator_sheet import operator_sheet
from planner.nouns.plan_file import DayOff, PlanDocument
from planner.protocols import Exported, ExportOptions

if TYPE_CHECKING:
    from icalendar import Event


class Calendar:
    """Appointments for people, and a sheet to print."""

    name = "ics"
    suffix = ".ics"
    dialects: tuple[str, ...] = ()

    def files(self, document: Mapping[str, Any], options: ExportOptions) -> Exported:
        """`attended.ics` and `operator.html`. Raises InputError for a wrong start or zone."""
        plan = checked_plan(document)
        options = started_with_the_plan(options, plan)
        clock = wall_clock(options)
        notes = checked_hours(plan, clock)
        files: dict[str, str | bytes] = {
            "attended.ics": _calendar(document, plan, clock),
            "operator.html": operator_sheet(document, plan, clock),
        }
        return Exported(files, (*_assumed(options), *notes))


def _assumed(options: ExportOptions) -> tuple[str, ...]:
    if options.start is not None and options.timezone is not None:
        return ()
    start, zone = options.start or DEFAULT_START, options.timezone or DEFAULT_TIMEZONE
    return (f"the campaign starts at {start}, {zone}; choose with --start and --timezone",)


def _calendar(document: Mapping[str, Any], plan: PlanDocument, clock: WallClock) -> bytes:
    from icalendar import Calendar as ICalendar
    from icalendar import vText

    calendar, tasks = ICalendar(), attendances(plan)
    calendar.add("prodid", "-//planner//calibration campaign//EN")
    calendar.add("version", "2.0")
    calendar.add("x-wr-calname", vText(document["spec"]["name"]))
    for name, value in header(document).items():
        calendar.add(f"x-{name.replace('_', '-')}", vText(value))
    for task in tasks:
        calendar.add_component(_event(document, task, clock))
    for day in _met(plan, clock):
        calendar.add_component(_day_off(document, day, clock))
    last = clock.at(max([0.0, *(t.end_s for t in tasks)]))
    # whole years, so that the definition holds both changes of the clocks
    calendar.add_missing_timezones(
        first_date=date(clock.start.year, 1, 1), last_date=date(last.year + 2, 1, 1)
    )
    return bytes(calendar.to_ical())


def _met(plan: PlanDocument, clock: WallClock) -> Sequence[DayOff]:
    """The days off between the start and the end of the campaign."""
    first, last = clock.start.date(), clock.at(plan.time_s).date()
    return [day for day in plan.days_off if first <= day.date <= last]


def _day_off(document: Mapping[str, Any], day: DayOff, clock: WallClock) -> Event:
    """A whole day on which nobody works; it takes nobody's time."""
    from icalendar import Event

    event = Event()
    event.add("uid", f"off-{day.date.isoformat()}@{document['plan_sha256'][:16]}.planner")
    event.add("dtstamp", clock.start.astimezone(UTC))
    event.add("dtstart", day.date)
    event.add("summary", f"Day off: {day.name}" if day.name else "Day off")
    event.add("transp", "TRANSPARENT")
    return event


def _event(document: Mapping[str, Any], task: HandTask, clock: WallClock) -> Event:
    from icalendar import Event

    event = Event()
    event.add("uid", f"{task.id}@{document['plan_sha256'][:16]}.planner")
    event.add("dtstamp", clock.start.astimezone(UTC))  # not the time of export: same plan, same bytes
    event.add("dtstart", clock.at(task.start_s))
    if clock.at(task.end_s) > clock.at(task.start_s):
        event.add("dtend", clock.at(task.end_s))
    event.add("summary", f"{task.what.capitalize()}{f' {task.test}' if task.test else ''}: {task.bench}")
    event.add("location", task.bench)
    event.add("description", _description(document, task))
    return event


def _description(document: Mapping[str, Any], task: HandTask) -> str:
    lines = [
        task.detail,
        "" if task.temperature_degc is None else f"temperature_degc: {task.temperature_degc:g}",
        f"elapsed: {elapsed_text(task.start_s)} to {elapsed_text(task.end_s)}",
        f"test: {task.test}, repeat {task.repeat}" if task.test else "",
        f"step: {task.id}",
        f"plan_sha256: {document['plan_sha256']}",
    ]
    return "\n".join(line for line in lines if line)


FORMAT = Calendar()
