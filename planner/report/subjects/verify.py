"""A verification: is the promise kept? The answer, then flights, budget, linearity, recount."""

from __future__ import annotations

from collections.abc import Iterator

from planner.report.blocks import (
    Block,
    Fact,
    Items,
    Report,
    Section,
    Table,
    Text,
    Verdict,
    existing,
    facts,
    section,
    table,
)
from planner.report.charts import verify as charts
from planner.report.numbers import digits, in_unit, percent, quantity
from planner.report.subjects import verify_words as words
from planner.spec.model import NAVIGATION_ERRORS
from planner.verify.outcome import RequirementOutcome
from planner.verify.verification import Verification

MOST_FAULTS = 200
SHOWN_FAULTS = 20  # on the terminal
SENSELESS = 0.3  # of the error: beyond, a curve of it says nothing


def verify_report(v: Verification) -> Report:
    """The answer, the requirements as flown, and what the answer rests on."""
    sentences = [f"Recount: {words.recount_sentence(v.recount)}."]
    if v.outcomes:
        sentences.append(f"Flights: {words.flight_sentence(v)}.")
    if v.files.units:
        sentences.append(f"Through files: {words.files_sentence(v.files)}.")
    return Report(
        kind="Verification of a plan",
        title=v.name,
        answer=words.headline(v),
        sentences=(*sentences, words.second_code()),
        verdicts=tuple(map(_verdict, v.worst)),
        notes=tuple(v.notes),
        facts=_facts(v),
        sections=_sections(v),
    )


def _verdict(o: RequirementOutcome) -> Verdict:
    share = "root mean square" if o.promised is None else percent(o.promised, 1)
    return Verdict(
        f"{o.error.replace('_', ' ')}: {share} of the flights within {quantity(o.at_promise, o.unit, 3)}, "
        f"limit {quantity(o.limit, o.unit)}",
        o.rule.replace("_", " "),
        o.at_promise,
        o.limit,
        o.verdict == "kept",
        word=words.VERDICTS[o.verdict].lower().removeprefix("the promise is "),
    )


def _facts(v: Verification) -> tuple[Fact, ...]:
    return facts(
        ("flights", digits(float(v.flights), 8)),
        ("flight", v.flown),
        ("seed", str(v.seed)),
        ("plan (SHA-256)", v.plan_sha256),
        ("spec (SHA-256)", v.spec_sha256),
    )


def _sections(v: Verification) -> tuple[Section, ...]:
    return existing(
        section("flights", "The flights", *_flights(v)),
        section("made", "What their errors are made of", *_made(v)),
        section("claims", "What the plan claims of its estimates", *_claims(v)),
        section("weak", "What the records do not determine", _weak_table(v)),
        section("linear", "Where the linear combination stops agreeing", *_linear(v), only="page"),
        section("files", "Through files", *_files(v)),
        section("recount", "The recount", *_recount(v)),
        section("independent", "What is independent, and what is shared", Items(INDEPENDENT), only="page"),
        section("basis", "How to read this", Items(BASIS), only="page"),
    )


BASIS = (
    "A unit is drawn from the spec's budgets, goes through every record of the plan in simulation, is "
    "calibrated by generalised least squares with the spec's variances, and flies the spec's flight: "
    "corrected readings through a nonlinear strapdown, in a power-on of its own, with in-run drift, with the "
    "noise that unit.noise gives, and flown_after the campaign's end unless the flight has a day.",
    "Each requirement is flown at the temperatures that it speaks of: anywhere in the range of use, in a "
    "distribution, at the start that verify's own linear model finds worst, or as the flight has it; a worst "
    "case always as the flight has it. The curves over temperature are of one family; the promise is kept "
    "if it is in each that was flown.",
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
    "Of a plan by information: a dense least-squares problem of the whole campaign, second moments of the "
    "families' curves from draws of its own, and every chance followed into flight by itself; so the figure "
    "of each family, the parts of the errors and their shares, to 2 %. Foreseen is that with curves drawn.",
    "The flights' own: the draws, power-on by power-on and day by day; the errors of the benches' "
    "references; the measurement equation; the design matrix and the estimator, which knows the spec's "
    "variances; the corrected readings. Which part of the navigation error comes from what, and how far the "
    "linear combination holds, is told by the same linear error equations that the planner solves.",
    "Through files, a few units are calibrated and corrected by the planner's own `calibrate` and `apply`.",
)


def _flights(v: Verification) -> Iterator[Block | None]:
    yield words.families_table(v)
    for o in v.worst:
        sentences = (words.share_sentence(o), words.types_sentence(o), words.pessimism_sentence(o))
        said = [sentence for sentence in sentences if sentence is not None]
        if o.verdict == "broken":
            said.append(f"too small in the budget: {', '.join(o.too_small)}")
        yield Items(tuple(said), f"{words.name_of(o)}: {o.verdict}")
        yield charts.flights_picture(o)
        yield _percentiles(o)


def _percentiles(o: RequirementOutcome) -> Table | None:
    every = [*((f"{p:g} % within", x) for p, x in o.percentiles), ("largest", o.largest)]
    return table(
        f"Percentiles of the {o.error.replace('_', ' ')} error",
        f"flights | error, {o.unit} | of the limit",
        ((name, digits(in_unit(x, o.unit)), _of_limit(x / o.limit)) for name, x in every),
        only="page",
    )


def _of_limit(ratio: float) -> str:
    return percent(ratio) if ratio < 10 else f"{digits(ratio, 3)} times"


def _made(v: Verification) -> Iterator[Block | None]:
    for o in v.worst:
        yield charts.parts_picture(o)
        yield words.parts_table(o)


def _claims(v: Verification) -> Iterator[Block | None]:
    low = [c for c in v.claims if c.high < c.claimed]
    yield table(
        "Estimates at the calibration temperatures, over all units",
        "error | within the half-width | 95 % interval | claimed |",
        (
            (
                c.error,
                percent(c.share),
                f"{percent(c.low)} to {percent(c.high)}",
                percent(c.claimed, 1),
                "fewer than claimed" if c in low else "",
            )
            for c in v.claims
        ),
        only="page",
    )
    for c in low:
        claimed = percent(c.claimed, 0)
        yield Text(
            f"Estimate of {c.error}: {percent(c.share)} within the half-width that is claimed for {claimed}.",
            only="console",
        )
    if low:
        yield Text(
            "Fewer than claimed: with the normal quantile the half-width t·s/√n is the published one, which "
            "knows the run-to-run spread alone; a simulated campaign also has in-run drift between the "
            "records, noise, and what the other coefficients of the same records take along. With Student's "
            "quantile s has them too; then noise that the spec does not give (unit.noise) may be what lacks.",
            only="page",
        )


def _weak_table(v: Verification) -> Table | None:
    return table(
        "Coefficients of the declared model that the plan's records leave open",
        "error | axis | why",
        ((w.error, w.axis, w.why) for w in v.weak),
    )


def _files(v: Verification) -> Iterator[Block | None]:
    yield table(
        "Units whose calibration and correction went through files",
        "unit | error | through files | directly | apart | may be",
        (
            (
                str(c.unit),
                c.error.replace("_", " "),
                *(
                    quantity(x, NAVIGATION_ERRORS[c.error], 3)
                    for x in (c.through_files, c.directly, c.apart, c.may)
                ),
            )
            for c in v.files.checks
        ),
        only="page",
    )
    if v.files.faults:
        yield Items(tuple(str(fault) for fault in v.files.faults))


def _linear(v: Verification) -> Iterator[Block | None]:
    picture = charts.linear_picture(v.linear)
    if picture is None:
        return
    if v.linear[-1].share == 1.0 and max(p.apart for p in v.linear if p.factor == 1.0) > SENSELESS:
        yield Text("The errors that these calibrations leave are too large for any linear combination.")
        return
    agreed = [p for p in v.linear if p.share == 1.0 and p.apart <= 0.01]
    if agreed:
        last = agreed[-1]
        yield Text(
            f"Within 1 % up to errors {digits(last.factor)} times those that the calibration leaves "
            f"({digits(last.size, 3)} m rms at the end of the flight)."
        )
    yield picture


def _recount(v: Verification) -> Iterator[Block | None]:
    yield table(
        "Counted again from plan.json and the spec alone",
        "check | what it says | figures |",
        (
            (c.name, c.what, digits(float(c.figures), 8), "agree" if c.ok else "FAULTS")
            for c in v.recount.checks
        ),
        only="page",
    )
    faults = [(f.check, f.where, f.what) for f in v.recount.faults]
    yield table("Faults", "check | where | what", faults[:MOST_FAULTS], most=SHOWN_FAULTS)
    if len(faults) > MOST_FAULTS:
        yield Text(f"And {len(faults) - MOST_FAULTS} more.", only="page")
    yield Items(tuple(v.recount.not_recounted), "Not counted again:", only="page")
