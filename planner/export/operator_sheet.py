"""A sheet to print and to tick off: what happens when, at which temperature, and what a person does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from planner.control.limits import by_bench
from planner.export._attended import HANDLING, HandTask, hand_tasks
from planner.export._clock import WallClock, elapsed_text, time_text
from planner.export.header import header
from planner.nouns.plan_file import PlanDocument
from planner.nouns.step import Step

_ALONE = {"ramp": "Chamber goes to temperature", "soak": "Unit soaks"}


@dataclass(frozen=True)
class Row:
    """One line of the sheet."""

    start_s: float
    day: str
    clock: str
    elapsed: str
    until: str
    bench: str
    temperature: str
    what: str
    attended: bool


def operator_sheet(document: Mapping[str, Any], plan: PlanDocument, clock: WallClock) -> str:
    """The sheet as one self-contained HTML page."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("planner.export"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    rows = sorted([*_by_hand(hand_tasks(plan), clock), *_alone(plan, clock)], key=lambda r: r.start_s)
    return environment.get_template("operator.html.j2").render(
        name=plan.spec.name,
        header=header(document),
        zone=str(clock.start.tzinfo),
        start=time_text(clock.start),
        end=time_text(clock.at(plan.time_s)),
        hours=f"{plan.time_s / 3600:.2f}",
        benches=plan.benches,
        stopped=any(bench.travel for bench in plan.benches.values()),
        rows=rows,
        attended=sum(row.attended for row in rows),
    )


def _row(clock: WallClock, start: float, end: float, bench: str, t: float | None, what: str, by: bool) -> Row:
    return Row(
        start_s=start,
        day=time_text(clock.at(start))[:-6],
        clock=f"{clock.at(start):%H:%M}",
        elapsed=elapsed_text(start),
        until=_until(clock, start, end),
        bench=bench,
        temperature="" if t is None else f"{t:.1f}".removesuffix(".0").replace("-", "−"),
        what=what,
        attended=by,
    )


def _until(clock: WallClock, start: float, end: float) -> str:
    """The time, and the day when it is another one."""
    begins, ends = time_text(clock.at(start)), time_text(clock.at(end))
    return ends[-5:] if ends[:-6] == begins[:-6] else f"{ends[:3]} {ends[-5:]}"


def _by_hand(tasks: Sequence[HandTask], clock: WallClock) -> Iterator[Row]:
    for t in tasks:
        where = "" if t.test is None else f" ({t.test}, repeat {t.repeat})"
        what = f"{t.what.capitalize()}{': ' if t.detail else ''}{t.detail}{where}"
        yield _row(clock, t.start_s, t.end_s, t.bench, t.temperature_degc, what, True)


def _alone(plan: PlanDocument, clock: WallClock) -> Iterator[Row]:
    """What the bench does by itself: ramps, soaks, and all repeats of a test at a temperature in one line."""
    for bench, steps in by_bench(plan.steps).items():
        alone = [step for step in steps if step.action not in HANDLING]
        for _, group in groupby(alone, key=lambda s: (s.test, s.temperature_degc, s.test or s.action)):
            own = list(group)
            first, last = own[0], own[-1]
            yield _row(clock, first.start_s, last.end_s, bench, first.temperature_degc, _what(own), False)


def _what(steps: Sequence[Step]) -> str:
    first = steps[0]
    if first.test is None:
        return _ALONE.get(first.action, first.action.replace("_", " ").capitalize())
    records = [step for step in steps if step.action == "record"]
    repeats = len({step.repeat for step in records})
    seconds = sorted({round(step.seconds, 3) for step in records})
    each = " or ".join(f"{s:g}" for s in seconds)
    return f"{first.test}: {_count(repeats, 'repeat')}, {_count(len(records), 'record')} of {each} s"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
