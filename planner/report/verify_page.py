"""The verification as one page that opens offline: the answer, then flights, budget, linearity, recount."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from planner.report.blocks import Block, Column, Items, Picture, Section, Table, Text, section
from planner.report.html import Fact
from planner.report.numbers import digits, in_unit, percent, quantity
from planner.report.page_template import page_template
from planner.report.verify_figures import flights_figure, linear_figure, parts_figure
from planner.report.verify_words import (
    VERDICTS,
    files_sentence,
    flight_sentence,
    headline,
    name_of,
    parts_table,
    pessimism_sentence,
    recount_sentence,
    share_sentence,
)
from planner.spec.model import NAVIGATION_ERRORS
from planner.verify.outcome import RequirementOutcome
from planner.verify.verification import Verification

MOST_FAULTS = 200
SENSELESS = 0.3  # of the error: beyond, a curve of it says nothing


@dataclass(frozen=True)
class Outcome:
    """A requirement in the headline: a bar up to the limit."""

    text: str
    detail: str
    used: str
    limit_at: str
    met: bool


def verify_html(v: Verification) -> str:
    """The page as text: the same verification gives the same bytes."""
    sentences = [f"Recount: {recount_sentence(v.recount)}."]
    if v.outcomes:
        sentences.append(f"Flights: {flight_sentence(v)}.")
    if v.files.units:
        sentences.append(f"Through files: {files_sentence(v.files)}.")
    return page(
        kind="Verification of a plan",
        name=v.name,
        headline=headline(v),
        sentences=sentences,
        bars=[_bar(o) for o in v.outcomes],
        notes=v.notes,
        facts=_facts(v),
        sections=_sections(v),
    )


def page(**content: Any) -> str:
    """The template with its content."""
    return page_template("verify.html.j2").render(**content)


def _bar(o: RequirementOutcome) -> Outcome:
    end = 1.05 * max(o.limit, min(o.at_promise, 20.0 * o.limit))
    used = 100 * min(1.0, o.at_promise / end)
    what = (
        "root mean square of the flights"
        if o.promised is None
        else f"{percent(o.promised, 1)} of the flights"
    )
    reached = f"{what} within {quantity(o.at_promise, o.unit, 3)}, limit {quantity(o.limit, o.unit)}"
    return Outcome(
        f"{o.error.replace('_', ' ')}: {reached}",
        f"{o.rule.replace('_', ' ')}: {VERDICTS[o.verdict].lower().removeprefix('the promise is ')}",
        f"{used:.2f}%",
        f"{100 * o.limit / end:.2f}%",
        o.verdict == "kept",
    )


def _facts(v: Verification) -> list[Fact]:
    found = [
        Fact("flights", digits(float(v.flights), 8)),
        Fact("flight", v.flown),
        Fact("planner", v.version),
        Fact("seed", str(v.seed)),
        Fact("plan (SHA-256)", v.plan_sha256),
        Fact("spec (SHA-256)", v.spec_sha256),
    ]
    return [fact for fact in found if fact.value]


def _sections(v: Verification) -> tuple[Section, ...]:
    every = (
        section("flights", "The flights", *_flights(v)),
        section("made", "What their errors are made of", *_made(v)),
        section("claims", "What the plan claims of its estimates", *_claims(v)),
        section("weak", "What the records cannot tell", _weak_table(v)),
        section("linear", "Where the linear combination stops agreeing", *_linear(v)),
        section("files", "Through files", *_files(v)),
        section("recount", "The recount", *_recount(v)),
        section("independent", "What is independent, and what is shared", Items(INDEPENDENT)),
        section("basis", "How to read this", Items(BASIS)),
    )
    return tuple(part for part in every if part is not None)


BASIS = (
    "A unit is drawn from the spec's budgets, goes through every record of the plan in simulation, is "
    "calibrated by generalised least squares with the spec's variances, and flies the spec's flight: "
    "corrected readings through a nonlinear strapdown, in a power-on of its own, with in-run drift, with the "
    "noise that unit.noise gives, and flown_after the campaign's end unless the flight has a day.",
    "worst_case promises that the limit holds in the plan's confidence share of the flights; a percentile "
    "that it holds in that share; rss that the root mean square of the flights does not exceed it.",
    "Intervals of shares are exact (Clopper and Pearson); kept or broken is said only when the whole "
    "interval is on one side of the promise.",
    "The parts add their mean squares: run to run, in run and storage are of the flight, temperature is what "
    "the table through the unit's own values leaves, estimate is what the campaign got wrong. Beside each "
    "size stands the plan's, marked ! where the flights had more.",
)
INDEPENDENT = (
    "Shared with the planner: the effects' regressors, the reading of the spec, units, the standard motions "
    "of the benches, and physics that is held to an independent implementation (Earth, attitude, strapdown).",
    "The recount's own: the rotations of the benches, the sensitivities (differences of flights through the "
    "nonlinear strapdown; the planner solves linear error equations, and the two may be a thousandth apart), "
    "the spread of one repeat (least squares on unit errors), allowances, repeats, schedule, hours, sums.",
    "The flights' own: the draws, power-on by power-on and day by day; the errors of the benches' "
    "references; the measurement equation; the design matrix and the estimator, which knows the spec's "
    "variances; the corrected readings. Which part of the navigation error comes from what, and how far the "
    "linear combination holds, is told by the same linear error equations that the planner solves.",
    "Through files, a few units are calibrated and corrected by the planner's own `calibrate` and `apply`.",
)


def _flights(v: Verification) -> Iterator[Block | None]:
    for o in v.outcomes:
        yield Text(f"{name_of(o)}: {o.verdict}. {share_sentence(o)}. {pessimism_sentence(o)}.")
        caption = f"{len(o.lengths)} flights; those beyond the scale stand in the last bar."
        yield Picture(flights_figure(o), caption)
        yield _percentiles(o)


def _percentiles(o: RequirementOutcome) -> Table:
    columns = (Column("flights", "text"), Column(f"error, {o.unit}"), Column("of the limit"))
    every = [*((f"{p:g} % within", x) for p, x in o.percentiles), ("largest", o.largest)]
    rows = [(name, digits(in_unit(x, o.unit)), _of_limit(x / o.limit)) for name, x in every]
    return Table(f"Percentiles of the {o.error.replace('_', ' ')} error", columns, tuple(rows))


def _of_limit(ratio: float) -> str:
    return percent(ratio) if ratio < 10 else f"{digits(ratio, 3)} times"


def _made(v: Verification) -> Iterator[Block | None]:
    for o in v.outcomes:
        yield Picture(parts_figure(o), f"{name_of(o)}, at the end of the time that it asks for.")
        yield parts_table(o)


def _claims(v: Verification) -> Iterator[Block | None]:
    if not v.claims:
        return
    columns = (
        Column("error", "text"),
        Column("within the half-width"),
        Column("95 % interval", "text"),
        Column("claimed"),
        Column("", "text"),
    )
    rows = tuple(
        (
            c.error,
            percent(c.share),
            f"{percent(c.low)} to {percent(c.high)}",
            percent(c.claimed, 1),
            "fewer than claimed" if c.high < c.claimed else "",
        )
        for c in v.claims
    )
    yield Table("Estimates at the calibration temperatures, over all units", columns, rows)
    if any(c.high < c.claimed for c in v.claims):
        yield Text(
            "Fewer than claimed: with the normal quantile the half-width t·s/√n is the published one, which "
            "knows the run-to-run spread alone; a simulated campaign also has in-run drift between the "
            "records, noise, and what the other coefficients of the same records take along. With Student's "
            "quantile s has them too; then noise that the spec does not give (unit.noise) may be what lacks."
        )


def _weak_table(v: Verification) -> Table | None:
    if not v.weak:
        return None
    columns = (Column("error", "text"), Column("axis", "text"), Column("why", "text"))
    caption = "Coefficients of the declared model that the plan's records leave open"
    return Table(caption, columns, tuple((w.error, w.axis, w.why) for w in v.weak))


def _files(v: Verification) -> Iterator[Block | None]:
    if not v.files.checks and not v.files.faults:
        return
    columns = (
        Column("unit", "text"),
        Column("error", "text"),
        Column("through files"),
        Column("directly"),
        Column("apart"),
        Column("may be"),
    )
    rows = tuple(
        (
            str(c.unit),
            c.error.replace("_", " "),
            *(
                quantity(x, NAVIGATION_ERRORS[c.error], 3)
                for x in (c.through_files, c.directly, c.apart, c.may)
            ),
        )
        for c in v.files.checks
    )
    yield Table("Units whose calibration and correction went through files", columns, rows)
    if v.files.faults:
        yield Items(tuple(str(fault) for fault in v.files.faults))


def _linear(v: Verification) -> Iterator[Block | None]:
    svg = linear_figure(v.linear)
    if svg is None:
        return
    if v.linear[-1].share == 1.0 and max(p.apart for p in v.linear if p.factor == 1.0) > SENSELESS:
        yield Text("The errors that these calibrations leave are too large for any linear combination.")
        return
    end = [p for p in v.linear if p.share == 1.0]
    agreed = [p for p in end if p.apart <= 0.01]
    if agreed:
        last = agreed[-1]
        yield Text(
            f"Within 1 % up to errors {digits(last.factor)} times those that the calibration leaves "
            f"({digits(last.size, 3)} m rms at the end of the flight)."
        )
    yield Picture(svg, "Root mean square over 50 units; left at the end of the flight, right as it goes on.")


def _recount(v: Verification) -> Iterator[Block | None]:
    columns = (Column("check", "text"), Column("what it says", "text"), Column("figures"), Column("", "text"))
    rows = tuple(
        (c.name, c.what, digits(float(c.figures), 8), "agree" if c.ok else "FAULTS") for c in v.recount.checks
    )
    yield Table("Counted again from plan.json and the spec alone", columns, rows)
    if v.recount.faults:
        places = (Column("check", "text"), Column("where", "text"), Column("what", "text"))
        found = tuple((f.check, f.where, f.what) for f in v.recount.faults[:MOST_FAULTS])
        yield Table("Faults", places, found)
        if len(v.recount.faults) > MOST_FAULTS:
            yield Text(f"And {len(v.recount.faults) - MOST_FAULTS} more.")
    yield Text("Not counted again:")
    yield Items(v.recount.not_recounted)
