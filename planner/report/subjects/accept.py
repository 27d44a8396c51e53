"""A batch judged: which units pass, by how much, what binds, and what would decide the rest."""

from __future__ import annotations

import math
from collections.abc import Sequence

from planner.fleet.acceptance import ChannelAcceptance, UnitAcceptance, counts
from planner.fleet.allowed_region import AllowedRegion, TermConstraint
from planner.fleet.judge import MOST_RECORDS, ErrorRates
from planner.report.blocks import Items, Report, Table, existing, facts, section, table
from planner.report.charts import fleet as charts
from planner.report.numbers import NOTHING, SPACE, counted, digits, percent, quantity
from planner.report.readable import shown_in

SHOWN_CHANNELS = 60  # rows on the terminal; the page has all
MOST_NOTES = 12


def accept_report(
    units: Sequence[UnitAcceptance], region: AllowedRegion, rates: ErrorRates, name: str, notes: Sequence[str]
) -> Report:
    """The batch, where its units lie in the allowed region, and every channel."""
    ordered = sorted(units, key=lambda u: (-u.load, u.unit))
    adds = region.constraints[units[0].constraint].rule == "worst_case"
    return Report(
        kind="Units held against a plan",
        title=name,
        answer=headline(units),
        sentences=(sentence(units, region),),
        notes=tuple(notes),
        facts=facts(
            ("units", str(len(units))),
            ("good rejected, at most", percent(rates.good_rejected)),
            ("bad accepted, at most", percent(rates.bad_accepted)),
            ("power-ons", str(sum(u.power_ons for u in units))),
            ("records", str(sum(u.records for u in units))),
            brief=("good rejected, at most", "bad accepted, at most"),
        ),
        sections=existing(
            section("batch", "The batch", charts.batch_picture(ordered), units_table(ordered, region)),
            section("region", "Where they lie in the allowed region", charts.region_picture(units, adds)),
            section("channels", "Channel by channel", channels_table(ordered)),
            section("remarks", "What is odd about single units", _remarks(units)),
            section("basis", "How to read this", Items(basis(rates)), only="page"),
        ),
    )


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


def units_table(units: Sequence[UnitAcceptance], region: AllowedRegion) -> Table | None:
    """A row per unit."""
    return table(
        "Every unit, the fullest first",
        "unit | verdict | share of the limit, % | surely between, % | requirement that binds | gyros, % "
        "| accelerometers, % | power-ons | further power-ons",
        (_row(u, region) for u in units),
        wide=("requirement that binds", "gyros, %", "accelerometers, %"),
    )


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


def channels_table(units: Sequence[UnitAcceptance]) -> Table | None:
    """A row per unit and channel: the term that takes most of the limit."""
    return table(
        "The term of each channel that takes most of the limit; room: what all others leave it",
        "unit | channel | term | residual | ± 95 % | planned | room | in | of the limit, % | is",
        (_channel_row(u, c) for u in units for c in u.channels),
        most=SHOWN_CHANNELS,
        wide=("planned", "room"),
    )


def _channel_row(u: UnitAcceptance, c: ChannelAcceptance) -> tuple[str, ...]:
    values = (c.residual, c.uncertainty, c.planned, c.room)
    *cells, unit = shown_in(c.unit, values)
    cells = ["∞" if x == math.inf else cell for x, cell in zip(values, cells, strict=True)]
    share = f"{100 * c.share:.1f}"
    if c.place == "not measured":
        cells[:2], share = (NOTHING, NOTHING), NOTHING
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
