"""A plan's steps → the design of a simulated campaign: one row a record, with its true conditions."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.records import Array, Conditions, Step
from planner.simulate.attitudes import Exposure, exposure, mounting
from planner.spec.model import Spec

SECONDS_A_DAY = 86400.0
DEFAULT_LATITUDE = float(np.radians(45.0))
_BATCH = re.compile(r"^b(\d+)/")


@dataclass(frozen=True)
class Design:
    """n records of one unit, run by run.

    conditions: true ones at nominal temperatures; run: (n,) from 1; duration: (n,) s
    step, bench: (n,) text; starts: (g,) first row of every run
    """

    conditions: Conditions
    run: NDArray[np.int64]
    duration: Array
    step: NDArray[np.str_]
    bench: NDArray[np.str_]

    @property
    def starts(self) -> NDArray[np.int64]:
        """(g,) first row of every run."""
        return np.flatnonzero(np.append(True, np.diff(self.run) != 0))

    @property
    def runs(self) -> list[NDArray[np.int64]]:
        """Rows of every run."""
        return np.split(np.arange(len(self)), self.starts[1:])

    def __len__(self) -> int:
        return len(self.run)


def steps_of(document: Mapping[str, Any]) -> tuple[Step, ...]:
    """The steps of a plan.json tree."""
    names = (
        "id",
        "bench",
        "action",
        "start_s",
        "end_s",
        "test",
        "temperature_degc",
        "repeat",
        "motion",
        "units",
    )
    try:
        return tuple(Step(**{name: step[name] for name in names}) for step in document["steps"])
    except (KeyError, TypeError) as error:
        raise InputError(f"the plan's steps cannot be read: {error}") from error


def design(steps: Sequence[Step], spec: Spec, latitude: float = DEFAULT_LATITUDE) -> Design:
    """The records that the steps make of one unit (the first batch), with what it is exposed to.

    latitude: of the bench, rad. Raises InputError when there is no record among the steps.
    """
    mine = [s for s in steps if (match := _BATCH.match(s.id)) is None or int(match[1]) == 1]
    records = [s for s in mine if s.action == "record"]
    if not records:
        raise InputError("the plan has no record steps: nothing is measured")
    power_on = {_run_of(s): s.start_s for s in mine if s.action == "power_on"}
    runs = {name: i for i, name in enumerate(dict.fromkeys(map(_run_of, records)), start=1)}
    middle = np.array([(s.start_s + s.end_s) / 2.0 for s in records])
    on = np.array([power_on.get(_run_of(s), s.start_s) for s in records])
    seen = [_exposed(s, spec, latitude) for s in records]
    return Design(
        Conditions(
            rate=np.array([e.rate for e in seen]),
            specific_force=np.array([e.specific_force for e in seen]),
            temperature_degc=np.array([_temperature(s, spec) for s in records]),
            temperature_rate=np.zeros(len(records)),
            time_on=middle - on,
            day=middle / SECONDS_A_DAY,
        ),
        np.array([runs[_run_of(s)] for s in records], dtype=np.int64),
        np.array([s.end_s - s.start_s for s in records]),
        np.array([s.id for s in records]),
        np.array([s.bench for s in records]),
    )


def _run_of(step: Step) -> str:
    """The power-on that a step belongs to: its id up to the repeat."""
    return re.sub(r"(/r\d+)/.*$", r"\1", step.id)


def _temperature(step: Step, spec: Spec) -> float:
    return spec.plan.temperatures.room if step.temperature_degc is None else step.temperature_degc


def _exposed(step: Step, spec: Spec, latitude: float) -> Exposure:
    bench = spec.benches.get(step.bench)
    if bench is None:
        raise InputError(f"step {step.id} is on bench {step.bench}, which the spec does not have")
    return exposure(
        step.motion, step.end_s - step.start_s, latitude, arm=bench.arm, mount=_mount(step, spec, bench.axes)
    )


def _mount(step: Step, spec: Spec, axes: int) -> int:
    """Which body axis lies along axis 1."""
    number = re.search(r"/m(\d+)$", step.id)
    test = spec.tests.get(step.test or "")
    if number is None or test is None:
        return 2
    return mounting(int(number[1]) - 1, test.motion_count, axes)
