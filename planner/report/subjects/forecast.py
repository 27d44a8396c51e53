"""A fleet's drift: history, forecasts with bands, the allowed region over time, and the dates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import timedelta

from planner.fleet.allowed_region import AllowedRegion
from planner.fleet.appointment import Appointment
from planner.fleet.dates import FleetForecast, UnitDate
from planner.fleet.drift import ChannelForecast
from planner.fleet.history import gathered
from planner.fleet.validation import MethodScore
from planner.report.blocks import Block, Items, Report, Table, Text, existing, facts, section, table
from planner.report.charts import fleet as charts
from planner.report.charts.year import YearMark, year_picture
from planner.report.numbers import NOTHING, counted, digits, level, names_are, percent
from planner.report.readable import shown_in

SHOWN_CHANNELS = 40  # rows on the terminal; the page has all
DRAWN_UNITS = 6  # units whose channels are drawn: those that are due first
DRAWN_LOADS = 12
_TOP = 2.0  # times the limit: further up nothing is told


def forecast_report(fleet: FleetForecast, region: AllowedRegion, name: str) -> Report:
    """The dates, which method forecasts best, and every channel."""
    return Report(
        kind="Drift in store",
        title=name,
        answer=headline(fleet),
        sentences=(sentence(fleet),),
        notes=tuple(fleet.notes),
        facts=facts(
            ("units", str(len(fleet.units))),
            ("channels", str(len(fleet.channels))),
            ("last value", fleet.history.label(fleet.history.last_day)),
            ("today", fleet.history.label(fleet.today)),
            ("looked until", fleet.history.label(fleet.until)),
            ("confidence", level(fleet.confidence)),
            ("corrected by", _corrected(fleet)),
        ),
        sections=existing(
            section("suspects", "Values that cannot be right", _suspects(fleet)),
            section("dates", "Until when", dates_table(fleet, region), *_loads(fleet)),
            section("calendar", "The year on one calendar", _calendar(fleet), only="page"),
            section("methods", "Which method forecasts best", scores_table(fleet.scores, fleet)),
            section("channels", "History and forecast", *_pictures(fleet), only="page"),
            section("table", "Every channel", channels_table(fleet)),
            section("remarks", "What the dates rest on", _remarks(fleet)),
            section("basis", "How to read this", Items(basis(fleet)), only="page"),
        ),
    )


def _corrected(fleet: FleetForecast) -> str:
    said = {"none": "nothing: the values are residuals", "first": "the first value", "last": "the last value"}
    return said[fleet.correction]


def headline(fleet: FleetForecast) -> str:
    """What to do first: look at values that cannot be right, calibrate what is overdue, the first date."""
    if fleet.history.suspects:
        who = fleet.history.suspects[0].partition(":")[0]
        more = len(fleet.history.suspects) - 1
        others = f" and {counted(more, 'more unit')}" if more else ""
        return f"Look at the values of {who}{others} first"
    urgent = fleet.by_urgency
    overdue = [u for u in urgent if u.due_now]
    if overdue:
        return f"{names_are([u.unit for u in overdue])} overdue: calibrate now"
    dated = [u for u in urgent if u.outcome == "date"]
    if dated:
        return f"Calibrate {dated[0].unit} by {fleet.history.label(dated[0].day or 0.0)}"
    if all(u.outcome == "kept" for u in fleet.units):
        return f"No unit is due before {fleet.history.label(fleet.until)}"
    return "No date can be given"


def sentence(fleet: FleetForecast) -> str:
    """How many are due, and what the date means."""
    kinds = [u.outcome for u in fleet.units]
    parts = [
        f"{counted(kinds.count(k), 'unit')} {text}"
        for k, text in (
            ("passed", "beyond at the last value"),
            ("overdue", "overdue"),
            ("date", "due within the time looked at"),
            ("kept", "not due in it"),
            ("unknown", "without a date"),
        )
        if k in kinds
    ]
    return (
        f"{'; '.join(parts)}. Up to its date a unit keeps every requirement with {level(fleet.confidence)}."
    )


def dates_table(fleet: FleetForecast, region: AllowedRegion) -> Table | None:
    """A row per unit, the most urgent first."""
    return table(
        f"Dates, what is overdue first; share of the limit at {level(fleet.confidence)}",
        "unit | calibrate by | days from today | today, % | then, % | requirement | what takes most of it",
        (_date_row(u, fleet, region) for u in fleet.by_urgency),
        wide=("requirement", "days from today"),
    )


def _date_row(u: UnitDate, fleet: FleetForecast, region: AllowedRegion) -> tuple[str, ...]:
    if u.outcome == "unknown":
        return (u.unit, "no date: see below", NOTHING, NOTHING, NOTHING, NOTHING, NOTHING)
    c = region.constraints[u.constraint]
    ahead = NOTHING if u.day is None else digits(u.day - fleet.today, 4)
    terms = ", ".join(f"{name} {percent(share, 0)}" for name, share in u.terms if share >= 0.01)
    return (
        u.unit,
        _by(u, fleet),
        ahead,
        f"{100 * u.load_on(fleet.today):.1f}",
        f"{100 * u.load_on(float(u.days[-1]) if u.day is None else u.day):.1f}",
        f"{c.requirement + 1}: {c.error.replace('_', ' ')}",
        terms or NOTHING,
    )


def _by(u: UnitDate, fleet: FleetForecast) -> str:
    if u.outcome == "kept":
        return f"not before {fleet.history.label(fleet.until)}"
    day = fleet.history.label(u.day or 0.0)
    return f"overdue since {day}" if u.due_now else day


def scores_table(scores: Sequence[MethodScore], fleet: FleetForecast) -> Table | None:
    """Every method on every kind of error, naive among them."""
    return table(
        "Rolling origins: each method on values that came later",
        "error | method | values forecast | error (rms) | of naive | in | inside its band, % "
        "| band widened |",
        (_score_row(s, fleet) for s in scores),
        wide=("values forecast", "band widened"),
    )


def _score_row(s: MethodScore, fleet: FleetForecast) -> tuple[str, ...]:
    display = next(c.series.display for c in fleet.channels if c.series.error == s.kind)
    used = fleet.methods[s.kind] == s.method
    if not s.cases:
        return (s.kind, s.method, "0", NOTHING, NOTHING, "", NOTHING, NOTHING, "used" if used else s.why)
    beaten = s.method == "naive" or s.beats_naive
    said = [
        "recommended" if s.recommended else "" if beaten else "not better than naive",
        "used" if used else "",
    ]
    rms, unit = shown_in(display, (s.rmse,))
    return (
        s.kind,
        s.method,
        str(s.cases),
        rms,
        f"{s.rmse / s.naive_rmse:.2f}" if s.naive_rmse > 0 else NOTHING,
        unit,
        f"{100 * s.coverage:.1f}",
        f"{s.factor:.2f}",
        ", ".join(filter(None, said)),
    )


def channels_table(fleet: FleetForecast) -> Table | None:
    """A row per channel: last value, drift, value at the end of the horizon."""
    return table(
        f"Every channel, until {fleet.history.label(fleet.until)}",
        "unit | error | points | method | last value | drift per week | ± 95 % | at the end "
        f"| ± {level(fleet.confidence)} at the end | in",
        (_channel_row(c, fleet) for c in fleet.channels),
        most=SHOWN_CHANNELS,
        wide=("points", "method"),
    )


def _channel_row(c: ChannelForecast, fleet: FleetForecast) -> tuple[str, ...]:
    s = c.series
    head = (s.unit, f"{s.error} {s.term}", str(len(s)), c.method)
    if c.forecast is None:
        return (*head, *([NOTHING] * 5), c.why)
    half = float(c.forecast.half_width(fleet.confidence)[-1])
    values = (float(s.value[-1]), 7 * c.rate, 7 * c.rate_half, float(c.forecast.mean[-1]), half)
    return (*head, *shown_in(s.display, values))


def basis(fleet: FleetForecast) -> tuple[str, ...]:
    """What the figures mean."""
    said = level(fleet.confidence)
    return (
        f"Bands are {said} prediction intervals of the next measurements; the dates look at the true values.",
        "`hierarchical` is one model of the type of unit: a random walk, ageing, the season of the year and "
        "noise, whose sizes all units of the fleet teach each other. The spec's storage is where they start "
        "from; it counts where the data are silent and fades as they speak.",
        "Rolling origins show how every method would have forecast values that it had not seen; `--method` "
        "takes another one.",
        "Up to its date a unit stays within every requirement, from its last value on and all the time, "
        f"in {said} of the simulated futures, with what flights add (run-to-run, in-run, temperature "
        "residual). A date that lies before today is overdue.",
        "A step that nobody declared lets the level start anew, an outlier is set aside; both are said. Of "
        "the words beside a value only repair, replacement and recalibration begin a history anew.",
    )


def _suspects(fleet: FleetForecast) -> Items | None:
    return Items(tuple(f"{said}." for said in fleet.history.suspects)) if fleet.history.suspects else None


def _calendar(fleet: FleetForecast) -> Block | None:
    """Every date on one page of months; overdue units stand on today."""
    start = fleet.history.start
    if start is None or not any(u.day is not None for u in fleet.units):
        return None
    marks = [YearMark(max(u.day, fleet.today), 1, u.due_now) for u in fleet.units if u.day is not None]
    return year_picture("calibrations", "calibrations", marks, start, fleet.today)


def _remarks(fleet: FleetForecast) -> Items | None:
    notes = gathered([f"{u.unit}: {n}" for u in fleet.units for n in u.notes])
    short = [c for c in fleet.channels if c.why]
    notes += gathered([f"{c.series.name}: {c.why}" for c in short])
    return Items(tuple(f"{n}." for n in notes[:16])) if notes else None


def _loads(fleet: FleetForecast) -> Iterator[Block]:
    shown = [u for u in fleet.by_urgency if u.outcome != "unknown"][:DRAWN_LOADS]
    if not shown:
        return
    caption = (
        f"Share of the limit over time: median, and the level that {level(fleet.confidence)} of the futures "
        "stay below. The allowed region ends at 100 %; dots: the dates."
    )
    alt = f"Share of the limit over time of {len(shown)} units"
    loads = [charts.Load(u.unit, u.days, u.upper, u.middle, _dated(u)) for u in shown]
    yield charts.loads_picture("load-over-time", alt, caption, loads, fleet.history.start, _TOP)
    if len(fleet.units) > len(shown):
        yield Text(f"Drawn are the {len(shown)} units that are due first.", only="page")


def _dated(u: UnitDate) -> tuple[tuple[float, float], ...]:
    if u.day is None:
        return ()
    at = int(abs(u.days - u.day).argmin())
    return ((float(u.days[at]), float(u.upper[at])),)


def _pictures(fleet: FleetForecast) -> Iterator[Block]:
    units = [u.unit for u in fleet.by_urgency][:DRAWN_UNITS]
    for unit in units:
        own = [c for c in fleet.channels if c.series.unit == unit]
        caption = (
            f"{unit}: measured values with their uncertainty (one sigma), forecast, and its "
            f"{level(fleet.confidence)} band; dashed: what the unit corrects."
        )
        yield charts.drift_picture(unit, own, fleet, caption)
    if len(fleet.units) > len(units):
        yield Text(f"Drawn are the {len(units)} units that are due first; forecast.json has all.")


def appointments(fleet: FleetForecast, region: AllowedRegion) -> list[Appointment]:
    """What belongs on a calendar, overdue units on today; empty when the history has no dates."""
    start = fleet.history.start
    if start is None:
        return []
    found = []
    for u in fleet.by_urgency:
        if u.day is None:
            continue
        c = region.constraints[u.constraint]
        day = start + timedelta(days=int(max(u.day, fleet.today)))
        terms = ", ".join(f"{name} {100 * share:.0f} %" for name, share in u.terms)
        until = f"Up to {fleet.history.label(u.day)}" if u.due_now else "Up to this day"
        why = (
            f"{until} it keeps every requirement with {100 * fleet.confidence:g} %.\n"
            f"Requirement {c.requirement + 1}, {c.error.replace('_', ' ')}, is passed first.\n"
            f"What takes most of it: {terms}"
        )
        words = f"Calibrate {u.unit}: overdue since {fleet.history.label(u.day)}"
        found.append(Appointment(day, words if u.due_now else f"Calibrate {u.unit}", why))
    return found
