"""What every power-on draws anew is no other unit; leans that become others at one of them are.

Campaigns of plain NumPy in which few power-ons have turns: row by row a scale factor that scatters by 2e-5
from one of them to the next made any place the border of two units, with p < 1e-9 on three channels.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.another_unit import another_unit
from planner.diagnose.leans_change import leans_change
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hypotheses.hall import Noise, axes_apart, days, read

SCATTERS = Noise(2e-4, 1e-3, scale=2e-5)


def _every(table: DwellTable) -> np.ndarray:
    return np.ones(len(table), dtype=bool)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_scale_factor_that_every_power_on_draws(seed: int) -> None:
    table = read(axes_apart(seed, 3), seed, gyro=SCATTERS)
    assert another_unit(table, _every(table)) is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rows_of_another_unit_are_told_all_the_same(seed: int) -> None:
    hall = axes_apart(seed, 3)
    one, other = read(hall, seed, gyro=SCATTERS), read(hall, seed + 100, gyro=SCATTERS)
    later = (one.run >= 14)[:, None]
    assert one.gyro is not None
    assert one.acc is not None
    assert other.gyro is not None
    assert other.acc is not None
    table = replace(one, gyro=np.where(later, other.gyro, one.gyro), acc=np.where(later, other.acc, one.acc))
    found = another_unit(table, _every(table))
    assert found is not None
    assert abs(found.suspect.value - 14) <= 1  # a power-on about one axis tells two channels only


def test_leans_are_held_against_what_power_ons_draw() -> None:
    """Leans drawn at every power-on, by 0.01 deg, are as different on both sides of any place."""
    hall = days(5)
    rng = np.random.default_rng(5)
    run = np.unique(hall.run, return_inverse=True)[1]
    u = np.radians(hall.rate)
    drawn = np.radians(0.01) * rng.normal(size=(run.max() + 1, 2))
    y = u[:, 0] + np.sum(drawn[run] * u[:, 1:], axis=1) + np.radians(4e-4) * rng.normal(size=len(u))
    assert leans_change(y, u, 0, run)[17] > np.log(1e-3)
    assert leans_change(y + np.radians(0.1) * u[:, 1] * (run > 17), u, 0, run)[17] < np.log(1e-9)
