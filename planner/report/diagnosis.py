"""What is missing, on what evidence, at what cost: one page that opens offline, and lines on the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from planner.diagnosis import Diagnosis, NavigationCost
from planner.measured import DwellTable
from planner.report import diagnosis_figures as figures
from planner.report import diagnosis_words as words
from planner.report.blocks import Block, Items, Picture, Section, Text, section
from planner.report.html import Fact
from planner.report.numbers import digits, level, plain
from planner.report.page_template import page_template
from planner.report.summary import rich_table
from planner.report.terminal import room

if TYPE_CHECKING:
    from rich.console import Console

MOST_CHANNELS = 6
TERMINAL_COLUMNS = 130


@dataclass(frozen=True)
class Cost:
    """A requirement in the headline: bars before and after up to the limit."""

    text: str
    detail: str
    before: str
    after: str
    limit_at: str
    met: bool


def diagnosis_html(diagnosis: Diagnosis, table: DwellTable) -> str:
    """The page as text: the same diagnosis and table give the same bytes.

    table: the unit's rows, in the order of the evidence
    """
    return page_template("diagnosis.html.j2").render(
        unit=diagnosis.found.unit,
        name=diagnosis.spec_name,
        verdict=words.headline(diagnosis.found),
        sentence=words.sentence(diagnosis.found),
        costs=[cost(c) for c in diagnosis.navigation],
        notes=(*diagnosis.notes, *diagnosis.found.notes),
        facts=facts(diagnosis, table),
        sections=sections(diagnosis, table),
    )


def cost(c: NavigationCost) -> Cost:
    """The headline of one requirement; the bar ends at the largest of limit and error.

    An effect that the flight does not excite still costs what it has bent in the declared calibration.
    """
    bent = c.as_calibrated > c.before
    before = c.as_calibrated if bent else c.before
    when = "as the declared calibration leaves it" if bent else "if nobody compensates it"
    end = 1.05 * max(before, c.after, c.limit if c.limit > 0 else 0.0) or 1.0
    return Cost(
        f"{c.error.replace('_', ' ')}: {words.length(before, c)} {when}, "
        f"{words.length(c.after, c)} once it is compensated",
        f"of a limit of {words.length(c.limit, c)}",
        f"{100 * before / end:.2f}%",
        f"{100 * c.after / end:.2f}%",
        f"{100 * c.limit / end:.2f}%",
        before <= 0.1 * c.limit,
    )


def facts(diagnosis: Diagnosis, table: DwellTable) -> list[Fact]:
    """Where the diagnosis comes from."""
    found = [
        Fact("data", Path(diagnosis.source).name),
        Fact("records", digits(float(len(table)), 6)),
        Fact("power-ons", digits(float(len(set(table.run.tolist()))), 6)),
        Fact("planner", diagnosis.version),
        Fact("seed", str(diagnosis.seed)),
        Fact("data (SHA-256)", diagnosis.data_sha256),
        Fact("spec (SHA-256)", diagnosis.spec_sha256),
    ]
    return [fact for fact in found if fact.value]


def sections(diagnosis: Diagnosis, table: DwellTable) -> tuple[Section, ...]:
    """The numbered parts of the page."""
    found = diagnosis.found
    every = (
        section("found", "What was found", *_found(diagnosis, table)),
        section("change", f"Before and after, {words.where_held_out(diagnosis)}", *_change(diagnosis)),
        section("residual", "What is left, against every variable", *_against(diagnosis, table)),
        section("flight", "What it means in flight", *_flight(diagnosis)),
        section(
            "rivals",
            "Rivals, and what to measure next",
            words.rivals_table(found.effects),
            words.next_table(diagnosis.next_measurement),
        ),
        section("assumptions", "What the spec assumes", words.assumptions_table(found)),
        section("limits", "What was looked for in vain", words.limits_table(found)),
        section("untestable", "What these data cannot show", words.untestable_table(found)),
        section("basis", "How to read this", Items(tuple(_basis(diagnosis)))),
    )
    return tuple(part for part in every if part is not None)


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
        channels = [c for u in mine for c in u.channels]
        svg = figures.unnamed_figure(variable, channels, found.evidence, table)
        yield None if svg is None else Picture(svg, f"What is left against {what}, over its expected spread.")
    doubtful = [words.plain_name(e.effect) for e in found.effects if e.below_bench_uncertainty]
    if doubtful:
        yield Text(f"Below the bench's own uncertainty, so it may be the bench: {words.joined(doubtful)}.")
    for effect in dict.fromkeys(e.effect for e in found.effects):
        svg = figures.added_variable_figure(effect, found.effects, found.evidence)
        caption = (
            f"{words.headed(effect)}: each dot is a record. Across: what the effect "
            "adds to it; up: what was read; both after the declared model took what it can explain. Dark: "
            "means with two standard errors, which lie on the line when the effect is the whole truth."
        )
        yield None if svg is None else Picture(svg, caption)
    if not found.effects and not found.unknown:
        yield Text(words.sentence(found))


def _change(diagnosis: Diagnosis) -> Iterator[Block | None]:
    svg = figures.change_figure(diagnosis)
    caption = "Root mean square on rows held out, with 95 % intervals over power-ons; dashed: replicates."
    yield None if svg is None else Picture(svg, caption)
    yield words.residual_table(diagnosis)
    how = words.how_held_out(diagnosis)
    unnamed = sorted({words.short(c) for u in diagnosis.found.unknown for c in u.channels})
    if unnamed:
        how = (
            *how,
            f"What has no name is in no model: on {words.joined(unnamed)} it is left after as before.",
        )
    yield Items(how) if how else None


def _against(diagnosis: Diagnosis, table: DwellTable) -> Iterator[Block | None]:
    found = diagnosis.found
    touched = {words.short(c) for e in found.effects for c in e.channels}
    touched |= {words.short(c) for u in found.unknown for c in u.channels}
    shown = [e for e in found.evidence if words.short(e.channel) in touched] or list(found.evidence)
    for evidence in shown[:MOST_CHANNELS]:
        named = any(words.short(evidence.channel) in map(words.short, e.channels) for e in found.effects)
        svg = figures.residual_figure(evidence, table, named)
        caption = f"{words.short(evidence.channel)}: residual over the spread that the noise model expects."
        yield None if svg is None else Picture(svg, caption)
    others = [words.short(e.channel) for e in found.evidence if e not in shown[:MOST_CHANNELS]]
    if others:
        yield Text(f"Nothing was found on {words.joined(others)}: not drawn.")


def _flight(diagnosis: Diagnosis) -> Iterator[Block | None]:
    table = words.navigation_table(diagnosis.navigation)
    yield table
    if table is not None:
        level_ = level(diagnosis.navigation[0].confidence)
        yield Items(
            (
                *dict.fromkeys(f"{c.how[0].upper()}{c.how[1:]}." for c in diagnosis.navigation),
                "As the declared calibration leaves it: the declared coefficients have taken up on the bench "
                "what they could of the effect, which in flight may help or harm.",
                f"Compensated: what the intervals leave at {level_}, by the requirement's rule.",
            )
        )


# ---------------------------------------------------------------- terminal


def print_diagnosis(diagnoses: Sequence[Diagnosis], console: Console) -> None:
    """The summary of every unit."""
    with room(console, TERMINAL_COLUMNS):
        for d in diagnoses:
            console.print(f"[bold]{d.found.unit}: {words.headline(d.found)}[/bold]", markup=True)
            console.print(plain(words.sentence(d.found)), markup=False)
            tables = (
                words.found_table(d.found.effects),
                words.residual_table(d),
                words.navigation_table(d.navigation),
                words.rivals_table(d.found.effects),
                words.next_table(d.next_measurement),
            )
            for table in tables:
                if table is not None:
                    console.print(rich_table(table))
            if d.found.untestable:
                names = sorted({u.effect for u in d.found.untestable})
                console.print(plain(f"untestable: {', '.join(names)} (why: see the report)"), markup=False)
