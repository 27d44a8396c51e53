"""What every power-on draws anew is no other unit; leans that become others at one of them are.

Campaigns of plain NumPy in which few power-ons have turns: row by row a scale factor that scatters by 2e-5
from one of them to the next made any place the border of two units, with p < 1e-9 on three channels.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.another_unit import another_unit
from planner.diagnose.records.leans_change import leans_change
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import FACES, Hall, Log, Noise, axes_apart, days, read

SCATTERS = Noise(2e-4, 1e-3, scale=2e-5)


def _mostly_rests(seed: int) -> Hall:
    """Nine power-ons of six faces, of which the first, the fourth and the last have turns as well."""
    rng, log = np.random.default_rng([seed, 29]), Log()
    for k in range(9):
        log.on(rng.uniform(8.0, 50.0))
        if k in (0, 3, 8):
            log.on_the_table(rng, 20.0)
        else:
            for i in rng.permutation(6):
                log.record(*FACES[i], 20.0)
        log.day += 0.5
    return log.hall()


def _another_from(hall: Hall, seed: int, run: int) -> DwellTable:
    """Readings of one unit, from a power-on on those of another one."""
    one, other = read(hall, seed, gyro=SCATTERS), read(hall, seed + 100, gyro=SCATTERS)
    later = (one.run >= run)[:, None]
    assert one.gyro is not None
    assert one.acc is not None
    assert other.gyro is not None
    assert other.acc is not None
    gyro, acc = np.where(later, other.gyro, one.gyro), np.where(later, other.acc, one.acc)
    return replace(one, gyro=gyro, acc=acc)


def _every(table: DwellTable) -> np.ndarray:
    return np.ones(len(table), dtype=bool)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_scale_factor_that_every_power_on_draws(seed: int) -> None:
    table = read(axes_apart(seed, 3), seed, gyro=SCATTERS)
    assert another_unit(table, _every(table)) is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rows_of_another_unit_are_told_all_the_same(seed: int) -> None:
    table = _another_from(axes_apart(seed, 3), seed, 14)
    found = another_unit(table, _every(table))
    assert found is not None
    assert abs(found.suspect.value - 14) <= 1  # a power-on about one axis tells two channels only


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_where_the_unit_changes_is_what_all_sensors_say_together(seed: int) -> None:
    """Rests tell the gyros' leans nothing: by them it was any place up to the last power-on with turns."""
    table = _another_from(_mostly_rests(seed), seed, 5)
    found = another_unit(table, _every(table))
    assert found is not None
    assert found.suspect.value == 5
    assert set(table.run[found.kept]) in ({1, 2, 3, 4}, {5, 6, 7, 8, 9})


@pytest.mark.parametrize("seed", [1, 2])
def test_power_ons_that_may_be_of_either_unit_are_left_out(seed: int) -> None:
    """Gyros alone do not tell whose the rests between two power-ons with turns are."""
    table = replace(_another_from(_mostly_rests(seed), seed, 5), acc=None)
    found = another_unit(table, _every(table))
    assert found is not None
    assert found.suspect.low <= 5 <= found.suspect.high
    assert set(table.run[found.kept]) <= {1, 2, 3, 4} or set(table.run[found.kept]) <= {5, 6, 7, 8, 9}


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
