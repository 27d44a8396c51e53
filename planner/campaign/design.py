"""A plan's steps → the design of a simulated campaign: one row a record, with its true conditions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.campaign.exposure import Asked, mounting
from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, in_records
from planner.nouns.step import Step
from planner.quantities import DAY_S
from planner.spec.model import Spec

DEFAULT_LATITUDE = float(np.radians(45.0))


@dataclass(frozen=True)
class Design:
    """n records of one unit, run by run.

    conditions: true ones at nominal temperatures; run: (n,) from 1; duration: (n,) s
    step, bench: (n,) text; installation: (n,) from 1; asked: what each record asks of the bench
    """

    conditions: Conditions
    run: NDArray[np.int64]
    duration: Array
    step: NDArray[np.str_]
    bench: NDArray[np.str_]
    installation: NDArray[np.int64]
    asked: tuple[Asked, ...]

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


def design(steps: Sequence[Step], spec: Spec, latitude: float = DEFAULT_LATITUDE) -> Design:
    """The records that the steps make of one unit (the first batch), with what it is exposed to.

    latitude: of the bench, rad. Raises InputError when there is no record among the steps.
    """
    records = list(_records(step for step in steps if step.batch in (None, 1)))
    if not records:
        raise InputError("the plan has no record steps: nothing is measured")
    made = [r.step for r in records]
    asked = tuple(_asked(r, spec, latitude) for r in records)
    exposed = {key: a.exposed() for key, a in {a.key: a for a in asked}.items()}
    seen = [exposed[a.key] for a in asked]
    middle = np.array([(s.start_s + s.end_s) / 2.0 for s in made])
    duration = np.array([s.end_s - s.start_s for s in made])
    means = Conditions(
        rate=np.array([e.rate for e in seen]),
        specific_force=np.array([e.specific_force for e in seen]),
        temperature_degc=np.array([_temperature(s, spec) for s in made]),
        temperature_rate=np.array([(s.temperature_rate_degc_min or 0.0) / 60.0 for s in made]),
        time_on=middle - np.array([r.power_on_s for r in records]),
        day=middle / DAY_S,
    )
    return Design(
        in_records(means, duration),
        np.array([r.run for r in records], dtype=np.int64),
        duration,
        np.array([s.id for s in made]),
        np.array([s.bench for s in made]),
        np.array([r.installation for r in records], dtype=np.int64),
        asked,
    )


@dataclass(frozen=True)
class _Record:
    """A record step; run and installation from 1, power_on_s: when the run began, number: from 0 in it."""

    step: Step
    run: int
    installation: int
    power_on_s: float
    number: int


def _records(steps: Iterable[Step]) -> Iterator[_Record]:
    """The records of one unit in the order of its steps.

    A run lasts from power_on to power_off; records that no power_on precedes are one run a repeat. An
    installation lasts until the next one, or until another bench.
    """
    run = installation = number = 0
    bench, on, last = "", None, None
    for step in steps:
        if step.action == "install" or (step.action in ("power_on", "record") and step.bench != bench):
            installation, bench, on, number = installation + 1, step.bench, None, 0
        if step.action in ("power_on", "power_off"):
            on, number = step.start_s if step.action == "power_on" else None, 0
        if step.action != "record":
            continue
        repeat = (step.test, step.temperature_degc, step.repeat)
        if on is None and repeat != last:
            number = 0
        run, last = run + (number == 0), repeat
        yield _Record(step, run, installation, step.start_s if on is None else on, number)
        number += 1


def _temperature(step: Step, spec: Spec) -> float:
    return spec.plan.temperatures.room if step.temperature_degc is None else step.temperature_degc


def _asked(record: _Record, spec: Spec, latitude: float) -> Asked:
    step = record.step
    bench = spec.benches.get(step.bench)
    if bench is None:
        raise InputError(f"step {step.id} is on bench {step.bench}, which the spec does not have")
    test = spec.tests.get(step.test or "")
    count = 0 if test is None else test.motion_count
    mount = 2 if test is None else mounting(record.number % count, count, bench.axes)
    return Asked(step.motion or {}, step.end_s - step.start_s, latitude, bench.arm, mount)
