"""What people do in a campaign: install, remove, and turn or remount the unit where the bench cannot.

A levelled plate has no drive: every move is a person's. A centrifuge of one axis cannot turn the unit round:
when the sign of the load changes, a person does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from planner.export._scripts import by_bench, figure
from planner.export.plan_schema import BenchFacts, PlanDocument, PlannedStep

ALWAYS_ATTENDED = {"install": "install", "remove": "remove", "remount": "remount"}
TURN, PUT = "turn round", "put on its face"
BY_HAND = (TURN, PUT, "remount")


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
    test: str | None
    repeat: int | None


def hand_tasks(plan: PlanDocument) -> list[HandTask]:
    """Every single one, in the order of time."""
    found = [t for b, steps in by_bench(plan).items() for t in _on_bench(plan.benches[b], steps)]
    return sorted(found, key=lambda t: (t.start_s, t.end_s, t.id))


def attendances(plan: PlanDocument) -> list[HandTask]:
    """For calendars: the tasks within one repeat of a test are one appointment, from first to last."""
    found = []
    for _, group in groupby(hand_tasks(plan), key=lambda t: (t.bench, t.what, t.test, t.repeat, _solo(t))):
        tasks = list(group)
        first, last = tasks[0], tasks[-1]
        times = "" if len(tasks) == 1 else f"{len(tasks)} times; "
        found.append(_with(first, last.end_s, f"{times}{first.detail}"))
    return found


def _solo(task: HandTask) -> str:
    return task.id if task.test is None else f"{task.temperature_degc}"


def _with(task: HandTask, end_s: float, detail: str) -> HandTask:
    return HandTask(**{**vars(task), "end_s": end_s, "detail": detail})


def _on_bench(bench: BenchFacts, steps: Sequence[PlannedStep]) -> Iterator[HandTask]:
    load = 1.0  # the unit is installed with its axis outwards: positive loads
    for step in steps:
        if step.action in ALWAYS_ATTENDED:
            detail = f"{step.units} unit{'s' if step.units > 1 else ''}, {bench.kind.replace('_', ' ')}"
            yield _task(step, ALWAYS_ATTENDED[step.action], detail)
            load = 1.0
        elif step.action == "move" and bench.kind == "levelled_plate":
            yield _task(step, PUT, motion_text(step.motion or {}))
        elif step.action == "move" and _turned_round(bench, step, load):
            load = -load
            yield _task(step, TURN, f"then {motion_text(step.motion or {})}")


def _turned_round(bench: BenchFacts, step: PlannedStep, load: float) -> bool:
    asked = (step.motion or {}).get("acceleration_g", 0.0)
    return bench.axes == 1 and asked * load < 0


def _task(step: PlannedStep, what: str, detail: str) -> HandTask:
    return HandTask(
        id=step.id,
        bench=step.bench,
        what=what,
        detail=detail,
        start_s=step.start_s,
        end_s=step.end_s,
        units=step.units,
        temperature_degc=step.temperature_degc,
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
