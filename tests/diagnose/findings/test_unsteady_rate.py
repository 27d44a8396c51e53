"""Gyros that all scatter with the rate were turned by another rate than is written; one alone was not."""

from __future__ import annotations

import numpy as np
import pytest

from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import days, hidden, read
from tests.diagnose.worlds import whole

SHARE = 5e-4


def _scattered(seed: int, axes: tuple[int, ...], size: float = SHARE) -> DwellTable:
    """Every turn by another share of its rate, on some gyros."""
    hall, rng = days(seed, 12), np.random.default_rng([seed, 71])
    share = size * rng.normal(size=len(hall.run))
    table = read(hall, seed)
    for axis in axes:
        table = hidden(table, "gyro", axis, share * hall.turn[:, axis])
    return table


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_a_table_that_does_not_hold_its_rate(seed: int) -> None:
    """Nothing was said of it: the noise had taken it up."""
    found = whole(_scattered(seed, (0, 1, 2)))
    assert not found.effects
    (rate,) = found.reference_suspects
    assert rate.hypothesis == "table_rate"
    assert rate.low < SHARE < rate.high
    assert found.verdict == "explained"


@pytest.mark.parametrize(("axes", "size"), [((), SHARE), ((1,), SHARE), ((0, 1, 2), 1e-4)])
def test_gyros_that_do_not_all_scatter_or_by_as_much_as_drives_do(axes: tuple[int, ...], size: float) -> None:
    assert not whole(_scattered(4, axes, size)).reference_suspects
