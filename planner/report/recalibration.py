"""Recalibrations in store: the schedule, what each visit renews, and what only a campaign can."""

from __future__ import annotations

from datetime import timedelta
from typing import TYPE_CHECKING

from planner.fleet.appointment import Appointment
from planner.fleet.basis import Recalibrated
from planner.fleet.history import day_label
from planner.fleet.published_store import published, published_check
from planner.fleet.recalibration import ShortestVisit, StorePlan
from planner.fleet.store import Visit
from planner.report import recalibration_figures as figures
from planner.report.blocks import Column, Items, Picture, Table, section
from planner.report.fleet_page import Page, counted, page_html
from planner.report.html import Fact
from planner.report.numbers import NOTHING, digits, hours, in_unit, percent, plain
from planner.report.readable import readable_unit
from planner.report.summary import rich_table
from planner.report.terminal import room

if TYPE_CHECKING:
    from rich.console import Console

TERMINAL_COLUMNS = 150
DRAWN = 8


def recalibration_html(found: Recalibrated, name: str) -> str:
    """The page as text: the same schedule gives the same bytes."""
    svg = figures.schedule_figure(found.plans[:DRAWN], found.start)
    caption = (
        "Share of the limit over time: with the visits (line) and without them (dotted). The "
        "limit is at 100 %; "
        "every visit falls on the last day of the grid before it."
    )
    page = Page(
        title=f"{name}: recalibration in store",
        kind=f"Recalibration in store, held against {name}",
        headline=headline(found),
        sentence=sentence(found),
        notes=found.notes,
        facts=(
            Fact("units", str(len(found.plans))),
            Fact("visits", str(sum(len(p.visits) for p in found.plans))),
            Fact("hours", hours(sum(p.time_s for p in found.plans))),
            Fact("looked until", day_label(found.start, float(found.plans[0].days[-1]))),
        ),
        sections=(
            section("schedule", "The schedule", schedule_table(found), Picture(svg, caption)),
            section("shortest", "One visit: the shortest for a given date", shortest_table(found)),
            section("renews", "What the store can renew", renewal_table(found)),
            section("binding", "What is used up in the end", binding_table(found)),
            section("procedure", "What is done on a visit", Items(procedure(found))),
            section("published", "Beside the published recalibration", published_table(found)),
            section("basis", "How to read this", Items(BASIS)),
        ),
    )  # fmt: skip
    return page_html(page)


BASIS = (
    "A visit is made as late as the limits allow. Sizes add, or their squares, as the "
    "requirement's rule says; what "
    "flights add (run-to-run, in-run) and the temperature residual of the plan stay in all along.",
    "Renewed is a term of which the visit leaves less than there is; all others go on drifting "
    "from where they are.",
    "No visit changes the temperature: a renewed bias is the one at room temperature, taken to "
    "hold for the table "
    "over temperature as a shift.",
    "Least hours: of all sequences of visits on a grid of days; visits that differ by less than a "
    "thousandth of the limit count as one. A search that keeps whatever may still win.",
)


def headline(found: Recalibrated) -> str:
    """Visits and hours, or how far the store carries."""
    lacking = [p for p in found.plans if not p.whole]
    if lacking:
        first = min(lacking, key=lambda p: p.kept_until)
        who = "" if first.unit == "spec" else f" {first.unit}"
        return f"The store carries{who} until {day_label(found.start, first.kept_until)}, not to the end"
    visits = sum(len(p.visits) for p in found.plans)
    if not visits:
        return "No recalibration is needed"
    return f"{counted(visits, 'visit')}, {hours(sum(p.time_s for p in found.plans))} h in all"


def sentence(found: Recalibrated) -> str:
    """The next visit, and the proof."""
    due = [(p.visits[0].day, p) for p in found.plans if p.visits]
    proved = all(p.proved for p in found.plans)
    told = (
        "No schedule of such visits costs less."
        if proved
        else "The search was stopped: a cheaper one may exist."
    )
    if not due:
        return (
            told if any(not p.whole for p in found.plans) else "Every unit keeps its requirements to the end."
        )
    day, plan = min(due, key=lambda d: d[0])
    who = "" if plan.unit == "spec" else f" ({plan.unit})"
    words = visit_words(plan.visits[0].visit)
    return f"The next visit{who} is due on {day_label(found.start, day)}: {words}. {told}"


def visit_words(visit: Visit) -> str:
    """`4 power-ons with rests, 1 with turns, 2.60 h`."""
    parts = [f"{counted(visit.rests, 'power-on')} with rests"] if visit.rests else []
    parts += [f"{visit.turns} with turns"] if visit.turns else []
    return f"{', '.join(parts)}, {hours(visit.time_s)} h"


def schedule_table(found: Recalibrated) -> Table | None:
    """A row per visit."""
    columns = (
        Column("unit", "text"),
        Column("on", "text"),
        Column("rests, power-ons"),
        Column("turns, power-ons"),
        Column("hours"),
        Column("before, %"),
        Column("after, %"),
        Column("renews", "text"),
    )
    rows = [
        (
            _who(p),
            day_label(found.start, v.day),
            str(v.visit.rests),
            str(v.visit.turns),
            hours(v.visit.time_s),
            f"{100 * v.load_before:.1f}",
            f"{100 * v.load_after:.1f}",
            _errors(v.renewed),
        )
        for p in found.plans
        for v in p.visits
    ]
    return Table("Visits; share of the limit before and after", columns, tuple(rows)) if rows else None


def _who(p: StorePlan) -> str:
    return "any unit" if p.unit == "spec" else p.unit


def _errors(names: tuple[str, ...]) -> str:
    """`gyro.bias, accelerometer.bias x y` from the names of terms."""
    by: dict[str, list[str]] = {}
    for name in names:
        error, term = name.split(" ")
        by.setdefault(error, []).append(term)
    return ", ".join(e if len(t) >= 3 else f"{e} {' '.join(t)}" for e, t in by.items()) or NOTHING


def shortest_table(found: Recalibrated) -> Table | None:
    """A row per day to be reached."""
    columns = (
        Column("unit", "text"),
        Column("visit on", "text"),
        Column("lasts until", "text"),
        Column("days"),
        Column("rests, power-ons"),
        Column("turns, power-ons"),
        Column("hours"),
        Column("without it, %"),
        Column("with it, %"),
    )
    rows = tuple(_shortest_row(s, found) for s in found.shortest)
    return Table("The shortest visit on the day a unit is due", columns, rows) if rows else None


def _shortest_row(s: ShortestVisit, found: Recalibrated) -> tuple[str, ...]:
    who = "any unit" if s.unit == "spec" else s.unit
    v = s.visit
    cells = ("no visit", NOTHING, NOTHING) if v is None else (str(v.rests), str(v.turns), hours(v.time_s))
    ends = (day_label(found.start, s.day), day_label(found.start, s.until), digits(s.until - s.day, 4))
    return (who, *ends, *cells, f"{100 * s.load_without:.1f}", f"{100 * s.load_with:.1f}")


def renewal_table(found: Recalibrated) -> Table:
    """A row per term: what the most thorough visit leaves, beside what there is in the end."""
    most = found.bench.asked.repeats
    quantile = 1.959963984540054
    left = found.bench.renewal(most, most).size(quantile)
    one = found.bench.renewal(1, 1).size(quantile)
    grown = found.growth.start + found.growth.between[:, 0, -1]
    columns = (
        Column("error", "text"),
        Column("after one power-on"),
        Column(f"after {most}"),
        Column("without, at the end"),
        Column("in", "text"),
        Column("", "text"),
    )
    rows: list[tuple[str, ...]] = []
    for t, term in enumerate(found.basis.region.terms):
        shown = readable_unit(term.unit, float(grown[t]))
        cells = [
            digits(in_unit(float(v), shown), 3) if v < 1e3 else NOTHING for v in (one[t], left[t], grown[t])
        ]
        said = "renewed" if found.renewable[t] else "stays as it is"
        row = (*cells, "%" if shown in ("", "1") else shown, said)
        if rows and rows[-1][0].split(" ")[0] == term.error and rows[-1][1:] == row:
            rows[-1] = (f"{rows[-1][0]} {term.term}", *row)
        else:
            rows.append((term.name, *row))
    caption = "95 % of what is left of each term" + (
        "" if len(found.plans) == 1 else f", {found.plans[0].unit}"
    )
    return Table(caption, columns, tuple(rows))


def binding_table(found: Recalibrated) -> Table:
    """What takes most of the limit on the last day that is kept."""
    columns = (
        Column("unit", "text"),
        Column("kept until", "text"),
        Column("term", "text"),
        Column("share of the limit, %"),
        Column("the store", "text"),
    )
    rows = tuple(
        (_who(p), day_label(found.start, p.kept_until), name, f"{100 * share:.1f}",
         "renews it" if can else "cannot renew it")
        for p in found.plans
        for name, share, can in p.binding[:3]
    )  # fmt: skip
    return Table("The largest terms when the end is reached, or the limit", columns, rows)


def procedure(found: Recalibrated) -> tuple[str, ...]:
    """The work of one visit in sentences."""
    a = found.bench.asked
    again = ", then again after half a turn on the surface" if a.headings == 2 else ""
    return (
        f"Set up: {hours(a.set_up)} h. Every repeat is one power-on of the unit, "
        f"{digits(a.cool_down / 60, 3)} min off "
        "after it.",
        f"Rests: the unit on each of its six faces{again}, {digits(a.rest, 4)} s recorded on each, "
        f"{digits(a.move, 4)} s to move it.",
        f"Turns: about each axis, upright, {counted(a.turns, 'whole turn')} one way and the "
        "other against a mark, "
        f"{digits(a.turn, 4)} s a turn.",
        "Gyro bias from the rests (the Earth's rate cancels over the faces), gyro scale factor from "
        "(∫ω dt − angle) / angle, accelerometer bias and scale factor from faces up and down.",
    )


def published_table(found: Recalibrated) -> Table:
    """The published figures beside what this procedure leaves of the same unit."""
    columns = (
        Column("error", "text"),
        Column("before"),
        Column("published after"),
        Column("here after"),
        Column("in", "text"),
        Column("published, %"),
        Column("here, %"),
    )
    rows = []
    for p, here in zip(published(), published_check(found.bench.asked), strict=True):
        values = [digits(in_unit(v, p.unit), 3) for v in (p.before, p.after, here)]
        cuts = [f"−{100 * (1 - v / p.before):.0f}" for v in (p.after, here)]
        rows.append((p.error, *values, "%" if p.unit == "1" else p.unit, *cuts))
    caption = "Residual errors before and after one repeat, one sigma (K table 2.19), and their reduction"
    return Table(caption, columns, tuple(rows))


def store_appointments(found: Recalibrated) -> list[Appointment]:
    """What belongs on a calendar; empty without a date of day 0."""
    if found.start is None:
        return []
    return [
        Appointment(
            found.start + timedelta(days=int(v.day)),
            f"Recalibrate {_who(p)} in store",
            f"{visit_words(v.visit)}\nrenews: {_errors(v.renewed)}\n"
            f"share of the limit: {100 * v.load_before:.0f} % before, {100 * v.load_after:.0f} % after",
        )
        for p in found.plans
        for v in p.visits
    ]


def why_not(found: Recalibrated) -> str:
    """Why the store cannot carry every unit to the end; empty if it can."""
    lacking = [p for p in found.plans if not p.whole]
    if not lacking:
        return ""
    p = min(lacking, key=lambda q: q.kept_until)
    stays = [name for name, _, can in p.binding if not can]
    c = found.basis.region.constraints[p.constraint]
    said = ", ".join(f"{name} {percent(share, 0)}" for name, share, _ in p.binding[:3])
    more = f"; the store cannot renew {', '.join(stays)}" if stays else ""
    who = "a unit" if p.unit == "spec" else p.unit
    return plain(
        f"the store keeps {who} within {c.error.replace('_', ' ')} until "
        f"{day_label(found.start, p.kept_until)} only; "
        f"what takes most of the limit then: {said}{more}. Calibrate by then, or allow more repeats"
    )


def print_recalibration(found: Recalibrated, console: Console) -> None:
    """The summary on the terminal."""
    with room(console, TERMINAL_COLUMNS):
        console.print(f"[bold]{plain(headline(found))}[/bold]")
        console.print(plain(sentence(found)), markup=False)
        for table in (
            schedule_table(found),
            shortest_table(found),
            renewal_table(found),
            published_table(found),
        ):
            if table is not None:
                console.print(rich_table(table))
