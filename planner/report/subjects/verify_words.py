"""What a verification says, in words."""

from __future__ import annotations

from planner.report.blocks import Bar, Cell, Table, table
from planner.report.contributions import PART_NAMES
from planner.report.numbers import counted, digits, percent, quantity
from planner.units import from_si
from planner.verify.outcome import Part, RequirementOutcome
from planner.verify.recount import Recount
from planner.verify.through_files import SAID, ThroughFiles
from planner.verify.verification import Verification

MOST_PARTS = 10
LEAST_SHARE = 1e-3
VERDICTS = {"kept": "The promise is kept", "broken": "The promise is broken", "undecided": "Not sure yet"}
_MORE_FLIGHTS = 10_000  # tell shares of 95 % apart that differ by half a percent


def headline(v: Verification) -> str:
    """The answer in one line."""
    if any(f.where == "spec, sha256" for f in v.recount.faults):
        return "The promise is broken: the plan was made from another spec, or from this one before a change."
    if not v.recount.ok:
        return (
            f"The promise is broken: the plan is not what it says, {counted(len(v.recount.faults), 'fault')}."
        )
    if not v.files.ok:
        return f"The promise is broken: {SAID}."
    if not v.outcomes:
        return "The plan is what it says; nothing was flown."
    broken = [o for o in v.worst if o.verdict == "broken"]
    if broken:
        parts = ", ".join(broken[0].too_small[:3])
        where = f" with curves {broken[0].family}" if _several(v) else ""
        return f"The promise is broken: {name_of(broken[0])} is exceeded{where}; too small: {parts}."
    if v.verdict == "undecided":
        more = max(_MORE_FLIGHTS, 4 * v.flights)
        return f"Not sure yet after {v.flights} flights: fly more, with --flights {more}."
    return "The promise is kept."


def second_code() -> str:
    """What the answer rests on."""
    return (
        "Counted, drawn, calibrated and flown by verify's own code; shared with the planner: effects, spec, "
        "units, physics."
    )


def recount_sentence(recount: Recount) -> str:
    """How many figures agree."""
    figures = digits(float(recount.figures), 7)
    if recount.ok:
        return f"{figures} figures of the plan counted again, all agree"
    return f"{figures} figures of the plan counted again, {counted(len(recount.faults), 'fault')}"


def files_sentence(files: ThroughFiles) -> str:
    """How far the two routes are apart."""
    worst = max((c.apart / c.may for c in files.checks if c.may > 0), default=0.0)
    end = f"apart by {percent(worst, 0)} of what the estimators' difference explains, at most"
    return (
        f"{counted(files.units, 'unit')} by dwell table, planner calibrate, planner apply and flight; {end}"
    )


def flight_sentence(v: Verification) -> str:
    """What was flown."""
    where = "; ".join(dict.fromkeys(o.starts for o in v.outcomes))
    stopped = f", stopped before {v.wanted}" if v.stopped else ""
    each = f" in each of the families {', '.join(v.families)}" if len(v.families) > 1 else ""
    curves = f", curves {v.families[0]}" if len(v.families) == 1 else ""
    return f"{v.flights} units calibrated and flown{each}{stopped}; {v.flown}, {where}{curves}, seed {v.seed}"


def families_table(v: Verification) -> Table | None:
    """Every requirement in every family of curves, where there are several."""
    rows = (
        (
            name_of(o),
            o.family,
            digits(from_si(o.achieved, o.unit)),
            "" if o.foreseen is None else digits(from_si(o.foreseen, o.unit)),
            f"{digits(from_si(o.at_promise, o.unit))} {o.unit}",
            percent(o.share, 2),
            o.verdict,
        )
        for o in v.outcomes
    )
    title = "Curves over temperature: each family that leaves the same table"
    return (
        table(title, "requirement | family | predicted | foreseen | flown | within the limit |", rows)
        if _several(v)
        else None
    )


def _several(v: Verification) -> bool:
    return len(v.families) > 1


def name_of(o: RequirementOutcome) -> str:
    """`position ≤ 300 m (worst case)`."""
    return f"{o.error.replace('_', ' ')} ≤ {quantity(o.limit, o.unit)} ({o.rule.replace('_', ' ')})"


def share_sentence(o: RequirementOutcome) -> str:
    """The share of the flights with its interval, or the root mean square."""
    interval = f"95 % interval {percent(o.low, 2)} to {percent(o.high, 2)}"
    inside = f"{percent(o.share, 2)} of the flights within the limit, {interval}"
    if o.promised is None:
        low, high = (quantity(x, o.unit, 3) for x in (o.rms_low, o.rms_high))
        return f"root mean square {quantity(o.rms, o.unit, 3)}, 95 % interval {low} to {high}; {inside}"
    return f"{inside}; promised {percent(o.promised, 1)}"


def types_sentence(o: RequirementOutcome) -> str | None:
    """Where spreads are estimates: in how many types of unit the promise is kept."""
    if o.types is None:
        return None
    t = o.types
    return (
        f"kept by {percent(t.share)} of {t.types} types of unit, each with true run-to-run spreads of its "
        f"own, 95 % interval {percent(t.low)} to {percent(t.high)}; promised with confidence "
        f"{percent(t.promised, 1)}"
    )


def pessimism_sentence(o: RequirementOutcome) -> str:
    """What the rule predicted against what happened."""
    what = "root mean square" if o.promised is None else f"{percent(o.promised, 1)} of the flights within"
    said = (
        f"predicted {quantity(o.achieved, o.unit)}, {what} {quantity(o.at_promise, o.unit)}: "
        f"{digits(o.pessimism, 3)} times"
    )
    if o.foreseen is None:
        return said
    return f"{said}; foreseen by verify's own linear model {quantity(o.foreseen, o.unit)}"


def parts_table(o: RequirementOutcome) -> Table | None:
    """What the navigation error is made of, the largest part first."""
    shown = [p for p in o.parts if p.share >= LEAST_SHARE][:MOST_PARTS]
    return table(
        f"What makes the {o.error.replace('_', ' ')} error",
        f"error | part | adds, {o.unit} | share of squares | | size (rms) | planned",
        (_row(o, p) for p in shown),
        wide=("share of squares",),
    )


def _row(o: RequirementOutcome, p: Part) -> tuple[Cell, ...]:
    mark = " !" if p.size > p.planned * (1 + 1e-6) and p.size > 1.1 * p.planned else ""
    return (
        p.error,
        PART_NAMES[p.part],
        digits(from_si(p.adds, o.unit), 3),
        percent(p.share),
        Bar(p.share),
        quantity(p.size, p.unit, 3),
        f"{quantity(p.planned, p.unit, 3)}{mark}",
    )
