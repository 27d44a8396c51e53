"""A batch judged: which units pass, by how much, what binds, and what would decide the rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from planner.fleet.acceptance import ChannelAcceptance, UnitAcceptance, counts
from planner.fleet.allowed_region import AllowedRegion, TermConstraint
from planner.fleet.judge import MOST_RECORDS, ErrorRates
from planner.report import accept_figures as figures
from planner.report.blocks import Column, Items, Picture, Table, section
from planner.report.fleet_page import Page, counted, page_html
from planner.report.html import Fact
from planner.report.numbers import NOTHING, SPACE, digits, in_unit, percent, plain, quantity
from planner.report.readable import readable_unit
from planner.report.summary import rich_table
from planner.report.terminal import room

if TYPE_CHECKING:
    from rich.console import Console

TERMINAL_COLUMNS = 150
SHOWN_CHANNELS = 60  # rows on the terminal; the page has all
MOST_NOTES = 12


def accept_html(
    units: Sequence[UnitAcceptance],
    region: AllowedRegion,
    rates: ErrorRates,
    name: str,
    notes: Sequence[str],
) -> str:
    """The page as text: the same units give the same bytes."""
    page = Page(
        title=f"{name}: accepted units",
        kind=f"Units held against {name}",
        headline=headline(units),
        sentence=sentence(units, region),
        notes=tuple(notes),
        facts=(
            Fact("units", str(len(units))),
            Fact("good rejected, at most", percent(rates.good_rejected)),
            Fact("bad accepted, at most", percent(rates.bad_accepted)),
            Fact("power-ons", str(sum(u.power_ons for u in units))),
            Fact("records", str(sum(u.records for u in units))),
        ),
        sections=(
            section("batch", "The batch", _picture_loads(units), units_table(units, region)),
            section("region", "Where they lie in the allowed region", _picture_region(units, region)),
            section("channels", "Channel by channel", channels_table(units)),
            section("remarks", "What is odd about single units", _remarks(units)),
            section("basis", "How to read this", Items(basis(rates))),
        ),
    )
    return page_html(page)


def headline(units: Sequence[UnitAcceptance]) -> str:
    """How many have which verdict."""
    found = counts(units)
    parts = [f"{number} {verdict}" for verdict, number in found.items() if number]
    return f"Of {counted(len(units), 'unit')}: {', '.join(parts)}"


def sentence(units: Sequence[UnitAcceptance], region: AllowedRegion) -> str:
    """Which unit is worst, and which requirement binds."""
    worst = max(units, key=lambda u: u.load)
    c = region.constraints[worst.constraint]
    used = f"{quantity(worst.value, c.unit, 3)} of {quantity(worst.limit, c.unit, 3)}"
    return f"The worst is {worst.unit}: {constraint_name(c)} {used}, {percent(worst.load)} of the limit."


def constraint_name(c: TermConstraint) -> str:
    """`position at 60 s, worst case`."""
    return f"{c.error.replace('_', ' ')} at {digits(c.time_s, 4)} s, {c.rule.replace('_', ' ')},"


def units_table(units: Sequence[UnitAcceptance], region: AllowedRegion) -> Table:
    """A row per unit, the worst first."""
    columns = (
        Column("unit", "text"),
        Column("verdict", "text"),
        Column("share of the limit, %"),
        Column("surely between, %", "text"),
        Column("requirement that binds", "text"),
        Column("gyros, %"),
        Column("accelerometers, %"),
        Column("power-ons"),
        Column("further power-ons"),
    )
    return Table("Every unit, the fullest first", columns, tuple(_row(u, region) for u in _ordered(units)))


def _ordered(units: Sequence[UnitAcceptance]) -> list[UnitAcceptance]:
    return sorted(units, key=lambda u: (-u.load, u.unit))


def _row(u: UnitAcceptance, region: AllowedRegion) -> tuple[str, ...]:
    c = region.constraints[u.constraint]
    return (
        u.unit,
        u.verdict.upper() if u.verdict == "rejected" else u.verdict,
        f"{100 * u.load:.1f}",
        f"{100 * u.low:.1f}{SPACE}…{SPACE}{100 * u.high:.1f}",
        f"{c.requirement + 1}: {c.error.replace('_', ' ')}",
        f"{100 * u.sensors[0]:.1f}",
        f"{100 * u.sensors[1]:.1f}",
        str(u.power_ons),
        further(u),
    )


def further(u: UnitAcceptance) -> str:
    """How many further power-ons would decide."""
    if u.further is None:
        return NOTHING
    if math.isinf(u.further):
        return f"over {MOST_RECORDS // 1000} 000"
    return digits(u.further, 6)


def channels_table(units: Sequence[UnitAcceptance], most: int | None = None) -> Table:
    """A row per unit and channel: the term that takes most of the limit."""
    columns = (
        Column("unit", "text"),
        Column("channel", "text"),
        Column("term", "text"),
        Column("residual"),
        Column("± 95 %"),
        Column("planned"),
        Column("room"),
        Column("in", "text"),
        Column("of the limit, %"),
        Column("is", "text"),
    )
    rows = [_channel_row(u, c) for u in _ordered(units) for c in u.channels]
    caption = "The term of each channel that takes most of the limit; room: what all others leave it"
    if most is not None and len(rows) > most:
        caption += f" (the first {most} of {len(rows)})"
    return Table(caption, columns, tuple(rows[:most]))


def _channel_row(u: UnitAcceptance, c: ChannelAcceptance) -> tuple[str, ...]:
    shown = readable_unit(c.unit, max(abs(c.residual), c.planned, c.uncertainty))
    values = (c.residual, c.uncertainty, c.planned, c.room)
    cells = [digits(in_unit(v, shown), 3) if math.isfinite(v) else "∞" for v in values]
    if c.place == "not measured":
        cells[0] = cells[1] = NOTHING
    unit = "%" if shown in ("", "1") else shown
    share = NOTHING if c.place == "not measured" else f"{100 * c.share:.1f}"
    return (u.unit, c.channel, c.term, *cells, unit, share, c.place)


def basis(rates: ErrorRates) -> tuple[str, ...]:
    """What the verdicts mean."""
    return (
        "All errors count together, through every requirement and its rule; the picture only folds them into "
        "two directions. Beside the residual stands what every flight adds: run-to-run, in-run, storage.",
        f"Accepted: of units past the limit at most {percent(rates.bad_accepted)} are accepted. Rejected: of "
        f"units within it at most {percent(rates.good_rejected)} are rejected. Undecided: "
        "neither can be said yet.",
        "Further power-ons: as many as would decide if the residual is what it seems; both "
        "margins shrink with "
        "the root of their number. The rates hold for one decision, not for looking again after "
        "every record.",
        "Room: how large a term may be while all others stay as they were measured. A channel "
        "is open when its "
        "95 % interval reaches over the room's edge.",
        "Run-to-run is averaged by the power-ons of the check; a unit that scatters more than the spec says "
        "is judged by its own spread and Student's t.",
    )


def _remarks(units: Sequence[UnitAcceptance]) -> Items | None:
    by_text: dict[str, list[str]] = {}
    for u in units:
        for note in u.notes:
            by_text.setdefault(note, []).append(u.unit)
    found = []
    for text, who in by_text.items():
        names = "all units" if len(who) == len(units) > 1 else ", ".join(who[:6])
        more = f" and {len(who) - 6} more" if len(who) > 6 and len(who) < len(units) else ""
        found.append(f"{names}{more}: {text}.")
    return Items(tuple(found[:MOST_NOTES])) if found else None


def _picture_loads(units: Sequence[UnitAcceptance]) -> Picture:
    caption = "Share of the limit that each unit uses, the fullest first; whiskers: where it surely lies."
    return Picture(figures.loads_figure(_ordered(units)), caption)


def _picture_region(units: Sequence[UnitAcceptance], region: AllowedRegion) -> Picture:
    rule = region.constraints[units[0].constraint].rule
    edge = (
        "a straight line: the parts add" if rule == "worst_case" else "a circle: the squares of the parts add"
    )
    caption = (
        "Every unit by what its gyros and its accelerometers take of the limit, each through "
        "all of its errors. "
        f"Inside the edge a unit keeps the requirement that binds it; the edge is {edge}."
    )
    return Picture(figures.region_figure(units, rule == "worst_case"), caption)


def print_accepted(
    units: Sequence[UnitAcceptance], region: AllowedRegion, rates: ErrorRates, console: Console
) -> None:
    """The summary on the terminal."""
    with room(console, TERMINAL_COLUMNS):
        console.print(f"[bold]{plain(headline(units))}[/bold]")
        console.print(plain(sentence(units, region)), markup=False)
        console.print(rich_table(units_table(units, region)))
        console.print(rich_table(channels_table(units, SHOWN_CHANNELS)))
        remarks = _remarks(units)
        for text in remarks.items if remarks else ():
            console.print(plain(text), markup=False)
        console.print(
            plain(
                f"good rejected <= {percent(rates.good_rejected)}, bad accepted <= "
                f"{percent(rates.bad_accepted)}"
            ),
            markup=False,
        )
