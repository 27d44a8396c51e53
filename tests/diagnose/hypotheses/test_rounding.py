"""What rounding leaves of a column explains nothing: figures do not hang on the last digit of a reading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.hypotheses.prepared import prepared
from planner.diagnose.hypotheses.sensor import Begun, begin
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from tests.calibrate.world import Layout, campaign
from tests.diagnose.hypotheses.worlds import DECLARED


def begun(table: DwellTable) -> Begun:
    """What a search begins with."""
    return begin(prepared(table), "gyro", DECLARED)


def apart(x: Array, y: Array) -> float:
    """The largest difference, in units of the largest value."""
    return float(np.abs(x - y).max() / np.abs(x).max())


@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12])
def test_the_last_digits_of_the_readings_change_no_figure(seed: int) -> None:
    """Days are one value a power-on, some curves lie in those declared: both leave nothing but rounding.

    Scaled to the length of a column that would be a direction of its own in every reading.
    """
    table = campaign(seed, layout=Layout(static_repeats=1, rate_repeats=1))
    assert table.gyro is not None
    digit = 1.0 + 1e-14 * np.random.default_rng(seed).normal(size=table.gyro.shape)
    first, second = begun(table), begun(replace(table, gyro=table.gyro * digit))
    for axis in range(3):
        assert np.array_equal(first.far[axis], second.far[axis])
        assert apart(first.sizes[axis], second.sizes[axis]) < 1e-5
        assert apart(first.pool.state[axis].remainder, second.pool.state[axis].remainder) < 1e-5
