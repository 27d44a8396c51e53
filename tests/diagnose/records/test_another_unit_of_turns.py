"""Another unit's turns beside one unit's rests, and another unit in campaigns of few power-ons."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.another_unit import another_unit
from planner.nouns.dwell_table import DwellTable
from planner.pipelines.data import simulate
from planner.simulate.settings import settings_of
from tests.diagnose.hall import ACC, GYRO, Hall, Noise, chamber, days, read
from tests.diagnose.records.test_another_unit_for_a_while import every
from tests.specs import shipped

LEANS = np.array([[0.0, 1.3, -0.9], [0.7, 0.0, 0.4], [-0.6, 1.1, 0.0]])  # mrad, of a g-sensitive gyro mrad/s


def _apart(seed: int) -> Hall:
    """Rests and turns about all axes have power-ons of their own, at five temperatures."""
    hall = days(seed, 20)
    return replace(hall, run=2 * hall.run + hall.turns)


def _two(hall: Hall, seed: int, there: np.ndarray) -> DwellTable:
    """Rows (n,) there are another unit's."""
    one, two = read(hall, seed), read(hall, seed + 500)
    assert one.gyro is not None
    assert one.acc is not None
    return replace(
        one,
        gyro=np.where(there[:, None], two.gyro, one.gyro),
        acc=np.where(there[:, None], two.acc, one.acc),
    )


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_turns_of_another_unit(seed: int) -> None:
    """A mounting by a degree and hystereses of the gyros were said of them."""
    hall = _apart(seed)
    table = _two(hall, seed, hall.turns)
    found = another_unit(table, every(table))
    assert found is not None
    assert found.suspect.hypothesis == "mixed_units"
    np.testing.assert_array_equal(found.kept, hall.turns)  # of which there are more


@pytest.mark.parametrize("seed", [11, 12])
@pytest.mark.further("seed", [13, 14])
def test_one_unit_that_turns_feel_otherwise(seed: int) -> None:
    """Mounted anew for turns, g-sensitive, asymmetric, with arms between accelerometers: one unit still."""
    hall = _apart(seed)
    leans = np.radians([0.3, -0.2, 0.25])
    felt = replace(hall, up=hall.up + np.where(hall.turns[:, None], np.cross(leans, hall.up), 0.0))
    plain = read(hall, seed, felt=felt)
    assert plain.gyro is not None
    assert plain.acc is not None
    gyro = plain.gyro + 1e-3 * hall.up @ LEANS.T + 1e-3 * np.abs(plain.ref_rate)
    acc = plain.acc + 0.03 * plain.ref_rate**2
    for table in (plain, replace(plain, gyro=gyro, acc=acc)):
        assert another_unit(table, every(table)) is None


@pytest.mark.parametrize(("power_ons", "theirs"), [(5, (2, 4)), (4, (3,)), (6, (3, 4))])
@pytest.mark.parametrize("seed", [21, 22])
@pytest.mark.further("seed", [23, 24])
def test_few_power_ons_through_all_temperatures(seed: int, power_ons: int, theirs: tuple[int, ...]) -> None:
    """Drifts and lags of all channels were said of them, or nothing beside budgets that are exceeded."""
    hall = chamber(seed, power_ons)
    there = np.isin(hall.run, theirs)
    found = another_unit(_two(hall, seed, there), every(read(hall, seed)))
    assert found is not None
    np.testing.assert_array_equal(found.kept, ~there)


@pytest.mark.parametrize("seed", [31, 32])
@pytest.mark.further("seed", [33, 34, 35])
def test_few_power_ons_of_one_unit(seed: int) -> None:
    """One that stood crooked, several that were clamped anew, levels that scatter: none is another unit's."""
    hall, rng = chamber(seed, 5), np.random.default_rng([seed, 9])
    crooked = np.where((hall.run == 3)[:, None], np.radians([0.2, -0.1, 0.3]), 0.0)
    clamped = np.radians(0.1) * rng.normal(size=(6, 3))[hall.run]
    for table in (
        read(hall, seed),
        read(hall, seed, felt=replace(hall, up=hall.up + np.cross(crooked, hall.up))),
        read(hall, seed, felt=replace(hall, up=hall.up + np.cross(clamped, hall.up))),
        read(hall, seed, gyro=replace(GYRO, level=2e-2), acc=Noise(ACC.white, 5e-3)),
    ):
        assert another_unit(table, every(table)) is None


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4, 5, 6])
def test_an_asymmetry_that_one_speed_does_not_tell_from_a_level_is_no_other_unit(seed: int) -> None:
    """Squares of rates that the Earth's rate alone told apart made levels of 21 m/s²: two of six seeds."""
    small = shipped("small_uav")
    hidden = ("gyro.scale_factor_asymmetry=0.05 %",)
    table, _ = simulate(small, None, hidden, seed, settings_of(small.spec))
    assert another_unit(table, every(table)) is None
