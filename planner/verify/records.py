"""The steps of plan.json → the records of one unit, power-on by power-on, as the references say.

The steps are gone through in the order of time: a power-on begins a run, an installation a new mounting.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, in_records
from planner.quantities import DAY_S
from planner.spec.model import Bench, Spec
from planner.verify.exposures import Motion, along_axis_1, earth_rate, motion_of, upward

_BATCH = re.compile(r"^b(\d+)/")
_NEEDED = ("id", "bench", "action", "start_s", "end_s", "test", "temperature_degc", "motion")


@dataclass(frozen=True)
class Records:
    """n records of one unit, run by run.

    conditions: as the references say, at nominal temperatures; run: (n,) from 1; duration: (n,) s
    step, bench: (n,) text; installation: (n,) from 0; motions: n of them; end_day: when the campaign ends
    """

    conditions: Conditions
    run: NDArray[np.int64]
    duration: Array
    step: NDArray[np.str_]
    bench: NDArray[np.str_]
    installation: NDArray[np.int64]
    motions: tuple[Motion, ...]
    end_day: float

    @property
    def starts(self) -> NDArray[np.int64]:
        """(g,) first row of every run."""
        return np.flatnonzero(np.append(True, np.diff(self.run) != 0))

    @property
    def runs(self) -> list[NDArray[np.int64]]:
        """Rows of every run."""
        return np.split(np.arange(len(self)), self.starts[1:])

    @property
    def on_day(self) -> Array:
        """(n,) day on which each record's power-on began: what walks in store stands while the unit is on."""
        starts = self.starts
        return np.repeat(self.conditions.day[starts], np.diff(np.append(starts, len(self))))

    def __len__(self) -> int:
        return len(self.run)


@dataclass(frozen=True)
class _Row:
    """One record: its step, its run and when that began, its place in the run, its installation."""

    step: Mapping[str, Any]
    run: int
    on_s: float
    place: int
    installation: int


def records_of(document: Mapping[str, Any], spec: Spec) -> Records:
    """The records of the first batch. Raises InputError when there is none, or a step cannot be read."""
    rows = _rows([s for s in _steps(document) if batch_of(s["id"]) == 1])
    if not rows:
        raise InputError("the plan has no record steps: nothing is measured")
    motions = tuple(_motion(row, spec) for row in rows)
    middle = np.array([(row.step["start_s"] + row.step["end_s"]) / 2.0 for row in rows])
    room = spec.plan.temperatures.room
    t = [row.step["temperature_degc"] for row in rows]
    rate, force = referred(motions)
    duration = np.array([row.step["end_s"] - row.step["start_s"] for row in rows])
    means = Conditions(
        rate=rate,
        specific_force=force,
        temperature_degc=np.array([room if x is None else float(x) for x in t]),
        temperature_rate=np.array([_rate(row.step) for row in rows]),
        time_on=middle - np.array([row.on_s for row in rows]),
        day=middle / DAY_S,
    )
    return Records(
        in_records(means, duration),
        np.array([row.run for row in rows], dtype=np.int64),
        duration,
        np.array([row.step["id"] for row in rows]),
        np.array([row.step["bench"] for row in rows]),
        np.array([row.installation for row in rows], dtype=np.int64),
        motions,
        max(float(row.step["end_s"]) for row in rows) / DAY_S,
    )


def _rate(step: Mapping[str, Any]) -> float:
    """K/s of the chamber during a record."""
    return float(step.get("temperature_rate_degc_min") or 0.0) / 60.0


def referred(motions: Sequence[Motion]) -> tuple[Array, Array]:
    """(n, 3) rate and specific force of the motions on a perfect bench."""
    rate = np.array([m.turned @ earth_rate() + m.driven for m in motions])
    return rate, np.array([m.turned @ upward() + m.pushed for m in motions])


def _steps(document: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    steps = document.get("steps")
    if not isinstance(steps, list) or not all(
        isinstance(s, dict) and all(k in s for k in _NEEDED) for s in steps
    ):
        raise InputError(f"the plan's steps cannot be read: each must have {', '.join(_NEEDED)}")
    return steps


def batch_of(name: str) -> int:
    """Which batch of units a step is for, by its id `b02/…`; 1: the only one."""
    found = _BATCH.match(name)
    return int(found[1]) if found else 1


def _rows(steps: Sequence[Mapping[str, Any]]) -> list[_Row]:
    rows: list[_Row] = []
    run = installation = place = 0
    on = False
    since = 0.0
    for step in sorted(steps, key=lambda s: float(s["start_s"])):
        match step["action"]:
            case "install":
                installation += 1
            case "power_on":
                run, on, since, place = run + 1, True, float(step["start_s"]), 0
            case "power_off":
                on = False
            case "record":
                if not on:  # without a power-on of its own a record begins one
                    run, on, since, place = run + 1, True, float(step["start_s"]), 0
                rows.append(_Row(step, run, since, place, installation))
                place += 1
    return rows


def _motion(row: _Row, spec: Spec) -> Motion:
    step = row.step
    bench = spec.benches.get(step["bench"])
    if bench is None:
        raise InputError(f"step {step['id']} is on bench {step['bench']}, which the spec does not have")
    test = spec.tests.get(step["test"] or "")
    count = 1 if test is None else test.motion_count
    return motion_on(bench, step["motion"], step["end_s"] - step["start_s"], row.place, count)


def motion_on(
    bench: Bench, asked: Mapping[str, float] | None, seconds: float, number: int, count: int
) -> Motion:
    """Motion `number` of `count` of one power-on, from 0."""
    return motion_of(asked, seconds, bench.arm, along_axis_1(number, count, bench.axes))
