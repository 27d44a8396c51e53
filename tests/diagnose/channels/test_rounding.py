"""What rounding leaves of a column explains nothing: figures do not hang on the last digit of a reading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import Begun, begin
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from tests.calibrate.world import Layout, campaign
from tests.diagnose.hall import anywhere, hidden, read
from tests.diagnose.worlds import DECLARED, whole


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


@pytest.mark.parametrize("seed", [21, 22])
def test_what_rounding_leaves_of_no_force_is_none(seed: int) -> None:
    """A lean of 1e15 deg of the table turned 1e-17 g of turns about a level axis into readings."""
    table = read(anywhere(seed), seed)
    assert table.ref_acc is not None
    level = np.abs(table.ref_acc) < 0.5 * np.abs(table.ref_acc).max()
    flat = np.where(level, 0.0, table.ref_acc)
    dust = 1e-16 * np.random.default_rng(seed).normal(size=flat.shape)
    assert np.array_equal(prepared(replace(table, ref_acc=flat + dust * level)).full.ref_acc, flat)


@pytest.mark.parametrize("seed", [23])
@pytest.mark.further("seed", [24, 25])
def test_a_strong_product_of_forces_is_found_in_references_of_nine_digits(seed: int) -> None:
    """Nothing was: the sum of the squares at rest is a bias, but for those digits, and that was 270 g."""
    hall = anywhere(seed, visits=6)
    still = ~hall.turns
    hall = type(hall)(*(getattr(hall, name)[still] for name in hall.__dataclass_fields__))
    table = hidden(read(hall, seed), "acc", 2, 2e-3 * hall.up[:, 0] * hall.up[:, 2])
    assert table.ref_acc is not None
    found = whole(replace(table, ref_acc=9.80665 * np.round(table.ref_acc / 9.80665, 9)))
    (effect,) = found.effects
    assert effect.effect == "cross_coupling"
    assert effect.channels == ("accelerometer_z",)
