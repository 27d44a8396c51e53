"""What people do in a campaign: install, remove or turn the unit where the bench cannot, and what
the spec has them attend: the power-ons and moves of a test.

A levelled plate has no drive: every move is a person's. A centrifuge of one axis cannot turn the unit round:
when the sign of the load changes, a person does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from planner.control.limits import by_bench
from planner.control.words import figure
from planner.nouns.bench import BenchFacts
from planner.nouns.plan_file import PlanDocument
from planner.nouns.step import Step

HANDLING = ("install", "remove")
TURN, PUT, MOVE, SWITCH = "turn round", "put on its face", "attend the move", "switch on"


@dataclass(frozen=True)
class HandTask:
    """One thing that a person does at a bench; times in seconds from the start of the campaign."""

    id: str
    bench: str
    what: str
    detail: str
    start_s: float
    end_s: float
    units: int
    temperature_degc: float | None
    visit: str
    test: str | None
    repeat: int | None


def hand_tasks(plan: PlanDocument) -> list[HandTask]:
    """Every single one, in the order of time."""
    found = [t for b, steps in by_bench(plan.steps).items() for t in _on_bench(plan.benches[b], steps)]
    return sorted(found, key=_time)


def attendances(plan: PlanDocument) -> list[HandTask]:
    """For calendars: the tasks within one repeat of a test are one appointment, from first to last."""
    found = []
    for bench, steps in by_bench(plan.steps).items():
        tasks = _on_bench(plan.benches[bench], steps)
        found += [_together(list(group)) for _, group in groupby(tasks, key=_visit)]
    return sorted(found, key=_time)


def _time(task: HandTask) -> tuple[float, float, str]:
    return task.start_s, task.end_s, task.id


def _visit(task: HandTask) -> tuple[object, ...]:
    return (task.id,) if task.test is None else (task.test, task.visit, task.repeat)


def _together(tasks: Sequence[HandTask]) -> HandTask:
    """`23 times; …` for one thing again and again, `switch on 1 time, attend the move 6 times` for more."""
    first = tasks[0]
    kinds = list(dict.fromkeys(task.what for task in tasks))
    if len(tasks) == 1:
        return first
    if len(kinds) == 1:
        return replace(first, end_s=tasks[-1].end_s, detail=f"{len(tasks)} times; {first.detail}")
    counts = [sum(task.what == kind for task in tasks) for kind in kinds]
    each = (f"{kind} {n} time{'s' if n > 1 else ''}" for kind, n in zip(kinds, counts, strict=True))
    return replace(first, what="attend", end_s=tasks[-1].end_s, detail=", ".join(each))


def _on_bench(bench: BenchFacts, steps: Sequence[Step]) -> Iterator[HandTask]:
    load = 1.0  # the unit is installed with its axis outwards: positive loads
    attended = False  # the whole repeat, and not only the moves at which the unit may have to be turned
    for step in steps:
        if step.action in HANDLING:
            load = 1.0
        if step.action == "power_on":
            attended = bool(step.attended)
        what = _what(bench, step, load, attended)
        if what == TURN:
            load = -load
        if what is not None and step.attended is not False:
            yield _task(step, what, _detail(bench, step, what))


def _what(bench: BenchFacts, step: Step, load: float, attended: bool) -> str | None:
    """What a person does in a step, or None; load: of the sign that the unit is mounted for."""
    if step.action in HANDLING:
        return step.action
    if step.action == "move" and not bench.driven:
        return PUT
    if (
        step.action == "move"
        and bench.axes == 1
        and (step.motion or {}).get("acceleration_g", 0.0) * load < 0
    ):
        return TURN
    return {"power_on": SWITCH, "move": MOVE}.get(step.action) if attended else None


def _detail(bench: BenchFacts, step: Step, what: str) -> str:
    if what in HANDLING:
        of = f"batch {step.batch}, " if step.batch is not None else ""
        return f"{of}{step.units} unit{'s' if step.units > 1 else ''}, {bench.kind.replace('_', ' ')}"
    motion = motion_text(step.motion or {})
    if what == SWITCH:
        return ""
    return f"then {motion}" if what == TURN else motion or "the next motion"


def _task(step: Step, what: str, detail: str) -> HandTask:
    return HandTask(
        id=step.id,
        bench=step.bench,
        what=what,
        detail=detail,
        start_s=step.start_s,
        end_s=step.end_s,
        units=step.units,
        temperature_degc=step.temperature_degc,
        visit=step.visit,
        test=step.test,
        repeat=step.repeat,
    )


def motion_text(motion: Mapping[str, float]) -> str:
    """A motion for people: `axis 1 at 90 deg, axis 2 at -50 deg/s`."""
    parts = []
    for key, value in motion.items():
        if key == "acceleration_g":
            parts.append(f"load {figure(value)} g")
        else:
            quantity, axis, _ = key.split("_")
            parts.append(f"axis {axis} at {figure(value)} {'deg' if quantity == 'position' else 'deg/s'}")
    return ", ".join(parts)
