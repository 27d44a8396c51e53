"""A test of the spec → the records of one repeat: one power-on of one unit, with what it is exposed to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.campaign.design import DEFAULT_LATITUDE
from planner.campaign.exposure import Asked, mounting
from planner.campaign.reference_errors import reference_errors
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, in_records
from planner.spec.attendance import record_time
from planner.spec.model import Bench, Spec, Test
from planner.spec.motions import motions_of
from planner.spec.ramp import lead_of, rates_of

ANY_DEGC = 20.0  # of a repeat; effects of temperature are not told apart within one


@dataclass(frozen=True)
class RepeatRecords:
    """The m records of one repeat of a test. duration: (m,) s; misplaced: of `reference_errors`."""

    test: str
    conditions: Conditions
    duration: Array
    misplaced: Array


def repeat_records(spec: Spec, name: str) -> RepeatRecords | None:
    """One repeat of a test; None on a bench of a kind whose motions we do not know."""
    test = spec.tests[name]
    bench = spec.benches[test.bench]
    motions = motions_of(test.bench, bench, test)
    if any(motion is None for motion in motions):
        return None
    m = len(motions)
    asked = [
        Asked(motion or {}, test.record, DEFAULT_LATITUDE, bench.arm, mounting(k, m, bench.axes))
        for k, motion in enumerate(motions)
    ]
    seen = [one.exposed() for one in asked]
    means = Conditions(
        rate=np.array([e.rate for e in seen]),
        specific_force=np.array([e.specific_force for e in seen]),
        temperature_degc=np.full(m, ANY_DEGC),
        temperature_rate=np.array(list(rates_of(test, m))),
        time_on=record_middles(bench, test, m),
        day=np.zeros(m),
    )
    misplaced = reference_errors(asked, [test.bench] * m, spec)
    duration = np.full(m, test.record)
    return RepeatRecords(name, in_records(means, duration), duration, misplaced)


def record_middles(bench: Bench, test: Test, count: int) -> Array:
    """(m,) seconds since power-on at the middle of every record: each has a move before it, a gap after."""
    first = test.power_on + bench.move + lead_of(test) + test.record / 2.0
    return np.asarray(first + record_time(bench, test) * np.arange(count))
