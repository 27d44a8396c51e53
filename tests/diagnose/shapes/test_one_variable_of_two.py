"""A curve over one variable before one over it and another; a scale factor that drifts after power-on."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE, simplest
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.array import Array
from tests.diagnose.hall import Hall, days, hidden, read
from tests.diagnose.worlds import DECLARED, named, unnamed


def _of(*names: str) -> Pool:
    return cast(Pool, SimpleNamespace(blocks=[SimpleNamespace(name=name) for name in names]))


def test_two_variables_must_be_decisively_better_than_one_of_them() -> None:
    pool = _of("time_on_and_rate", "rate", "temperature")
    assert simplest(pool, {0: 347.0, 1: 340.0, 2: 343.0}) == 1
    assert simplest(pool, {0: 347.0, 1: 347.0 - DECISIVE - 1.0, 2: 343.0}) == 0
    assert simplest(pool, {0: 347.0, 1: 340.0, 2: 350.0}) == 2


def _said(hall: Hall, seed: int, shape: Array) -> tuple[set[str], set[str]]:
    table = hidden(read(hall, seed), "gyro", 1, shape)
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, seed).found
    return {name for name, _ in named(found)}, {name for name, _ in unnamed(found)}


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4, 5])
def test_a_scale_factor_that_drifts_while_the_unit_is_on_is_no_wander(seed: int) -> None:
    """2e-5 of the rate in 1000 s, alike in every power-on: nothing was said, a process had it."""
    hall = days(seed, 24)
    size = 2e-5 * hall.turn[:, 1] * hall.time_on / 1000.0
    assert _said(hall, seed, np.asarray(size)) == (set(), {"time_on_and_rate"})
