"""What is missing, on what evidence, at what cost in flight, and what to measure next."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from planner.nouns.diagnosis import Diagnosis, NavigationCost, UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import short
from planner.report.blocks import Block, Fact, Items, Report, Section, Text, Verdict, existing, facts, section
from planner.report.charts import diagnosis as charts
from planner.report.charts import residuals
from planner.report.numbers import digits, level
from planner.report.subjects import diagnosis_findings as findings
from planner.report.subjects import diagnosis_next as further
from planner.report.subjects import diagnosis_not_found as not_found
from planner.report.subjects import diagnosis_words as words

MOST_CHANNELS = 6


def diagnosis_report(diagnosis: Diagnosis, table: DwellTable) -> Report:
    """The verdict, what it costs, and every part of the evidence.

    table: the unit's rows, in the order of the evidence
    """
    found = diagnosis.found
    return Report(
        kind=f"Diagnosis against {diagnosis.spec_name}",
        title=found.unit,
        answer=words.headline(found),
        sentences=tuple(_sentences(diagnosis)),
        verdicts=tuple(map(verdict, diagnosis.navigation)),
        notes=(*diagnosis.notes, *found.notes),
        facts=_facts(diagnosis, table),
        sections=sections(diagnosis, table),
    )


def _sentences(diagnosis: Diagnosis) -> Iterator[str]:
    """The verdict, residual before and after beside the floor, and what else a first look must see."""
    found = diagnosis.found
    yield words.sentence(found)
    sizes = further.sizes_sentence(found.effects)
    if sizes:
        yield sizes
    change = findings.change_sentence(found, diagnosis.residual)
    if change:
        yield change
    if found.rows_left_out:
        runs = len({r.run for r in found.rows_left_out})
        rows = len({(r.run, r.condition) for r in found.rows_left_out})
        yield f"Rows left out: {rows}, of {runs} power-ons: {found.rows_left_out[0].guess}."
    if found.budget_exceeded:
        yield findings.exceeded_sentence(found.budget_exceeded, diagnosis.campaign)
    worse = [c for c in diagnosis.navigation if not c.helps]
    if worse:
        yield findings.worse_sentence(worse[0])
    after = further.next_sentence(diagnosis)
    if after:
        yield after


def verdict(c: NavigationCost) -> Verdict:
    """One requirement: what the effect costs, before and after it is compensated.

    An effect that the flight does not excite still costs what it has bent in the declared calibration.
    """
    bent = c.as_calibrated > c.before
    before = c.as_calibrated if bent else c.before
    if math.isfinite(c.promised):
        return _total(c)
    when = "as the declared calibration leaves it" if bent else "if nobody compensates it"
    return Verdict(
        f"{c.error.replace('_', ' ')}: {words.length(before, c)} {when}, "
        f"{words.length(c.after, c)} once it is compensated",
        f"of a limit of {words.length(c.limit, c)}",
        reached=before,
        limit=max(c.limit, 0.0),
        met=before <= 0.1 * c.limit,
        after=c.after,
    )


def _total(c: NavigationCost) -> Verdict:
    """The flight in all, with what the plan promises."""
    return Verdict(
        f"{c.error.replace('_', ' ')}: the flight comes to {words.length(c.total_before, c)}, "
        f"{words.length(c.total_after, c)} once it is compensated",
        f"the plan promises {words.length(c.promised, c)} of {words.length(c.limit, c)}",
        reached=c.total_before,
        limit=max(c.limit, 0.0),
        met=c.total_before <= c.limit,
        after=c.total_after,
    )


def _facts(diagnosis: Diagnosis, table: DwellTable) -> tuple[Fact, ...]:
    """Where the diagnosis comes from."""
    return facts(
        ("data", Path(diagnosis.source).name),
        ("records", digits(float(len(table)), 6)),
        ("power-ons", digits(float(len(set(table.run.tolist()))), 6)),
        ("seed", str(diagnosis.seed)),
        ("data (SHA-256)", diagnosis.data_sha256),
        ("spec (SHA-256)", diagnosis.spec_sha256),
    )


def sections(diagnosis: Diagnosis, table: DwellTable) -> tuple[Section, ...]:
    """The numbered parts."""
    found = diagnosis.found
    rivals = (words.rivals_table(found.effects), words.next_table(diagnosis.next_measurement))
    return existing(
        section("found", "What was found", *_found(diagnosis, table)),
        section("bench", "References and records", *_bench(found)),
        section("change", f"Before and after, {words.where_held_out(diagnosis)}", *_change(diagnosis)),
        section("residual", "What is left, against every variable", *_against(diagnosis, table), only="page"),
        section("flight", "What it means in flight", *_flight(diagnosis)),
        section("rivals", "Rivals, and what to measure next", *rivals),
        section("assumptions", "What the spec assumes", words.assumptions_table(found), only="page"),
        section("refused", "Tried and not entered", findings.refused_table(found)),
        section("limits", "What was looked for in vain", not_found.limits_table(found), only="page"),
        section("untestable", "What these data cannot show", not_found.untestable_table(found), only="page"),
        section("unseen", "What these data cannot show", _untestable(diagnosis), only="console"),
        section("basis", "How to read this", Items(tuple(_basis(diagnosis))), only="page"),
    )


def _untestable(diagnosis: Diagnosis) -> Text | None:
    looked = {n.effect for n in diagnosis.found.not_found} | {e.effect for e in diagnosis.found.effects}
    names = sorted(
        {
            f"{u.effect} on the {u.sensor}s" if u.effect in looked and u.sensor else u.effect
            for u in diagnosis.found.untestable
        }
    )
    return Text(f"untestable: {', '.join(names)} (why: see the report)") if names else None


BASIS = (
    "The declared model is fitted with its products: a scale factor acts on the misaligned input.",
    "Every effect that the spec does not declare, and smooth or stepped alternatives without a physical "
    "name, compete for what is left; p counts all of them together (sign flips of whole power-ons, or of "
    "stretches of time where these are few).",
    "σ is the spread that replicates show for a record under its conditions: more at high rates.",
    "Within a run: about the mean of each power-on, without the turn-on bias, which none removes.",
    "Noise floor: the spread of records made alike, their pure error; no model of the unit leaves less.",
    "Metres are those of the linear error equations on the spec's trajectory; what varies without a name is "
    "not in them.",
)
HELD_OUT = (
    "Held out: whole power-ons that have a repeat among the others, from which the coefficients then come."
)


def _basis(diagnosis: Diagnosis) -> Iterator[str]:
    yield from BASIS
    if any(r.split == "runs" for r in diagnosis.residual):
        yield HELD_OUT


def _found(diagnosis: Diagnosis, table: DwellTable) -> Iterator[Block | None]:
    found = diagnosis.found
    yield words.found_table(found.effects)
    for variable in dict.fromkeys(u.varies_with for u in found.unknown):
        mine = [u for u in found.unknown if u.varies_with == variable]
        what = words.varies_with(variable)
        yield Text(f"Unnamed: something varies with {what} that no effect explains: {words.unnamed(mine)}.")
        yield words.curve_table([u.curve for u in mine if u.curve is not None])
        channels = [c for u in mine for c in u.channels]
        yield residuals.unnamed_picture(variable, channels, found.evidence, table)
    doubtful = [words.plain_name(e.effect) for e in found.effects if e.below_bench_uncertainty]
    if doubtful:
        yield Text(f"Below the bench's own uncertainty, so it may be the bench: {words.joined(doubtful)}.")
    for effect in dict.fromkeys(e.effect for e in found.effects):
        yield charts.added_variable_picture(effect, found.effects, found.evidence)
    if not found.effects and not found.unknown:
        yield Text(words.sentence(found), only="page")


def _bench(found: UnitDiagnosis) -> Iterator[Block | None]:
    yield findings.suspects_table(found.reference_suspects)
    yield findings.told_by(found.reference_suspects)
    yield findings.left_out_table(found.rows_left_out)
    yield findings.exceeded_table(found.budget_exceeded)


def _change(diagnosis: Diagnosis) -> Iterator[Block | None]:
    yield charts.change_picture(diagnosis)
    yield words.residual_table(diagnosis)
    how = words.how_held_out(diagnosis)
    unnamed = sorted({short(c) for u in diagnosis.found.unknown if not u.curve for c in u.channels})
    if unnamed:
        said = f"What has no curve is in no model: on {words.joined(unnamed)} it is left after as before."
        how = (*how, said)
    yield Items(how, only="page") if how else None


def _against(diagnosis: Diagnosis, table: DwellTable) -> Iterator[Block | None]:
    found = diagnosis.found
    named = {short(c) for e in found.effects for c in e.channels}
    touched = named | {short(c) for u in found.unknown for c in u.channels}
    shown = [e for e in found.evidence if short(e.channel) in touched] or list(found.evidence)
    yield residuals.residual_picture(shown[:MOST_CHANNELS], table, sorted(named))
    yield residuals.residual_table(found.evidence, table, sorted(named))
    others = [short(e.channel) for e in found.evidence if e not in shown[:MOST_CHANNELS]]
    if others:
        yield Text(f"Nothing was found on {words.joined(others)}: not drawn.")


def _flight(diagnosis: Diagnosis) -> Iterator[Block | None]:
    costs = diagnosis.navigation
    yield words.navigation_table(costs)
    if costs:
        said = (
            *dict.fromkeys(f"{c.how[0].upper()}{c.how[1:]}." for c in costs),
            "As the declared calibration leaves it: the declared coefficients have taken up on the bench "
            "what they could of the effect, which in flight may help or harm.",
            f"Compensated: what the intervals leave at {level(costs[0].confidence)}, by the requirement's "
            "rule.",
        )
        yield Items(said, only="page")
