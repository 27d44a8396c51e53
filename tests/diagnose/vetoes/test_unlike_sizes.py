"""What a part of the power-ons has, on one bench or from one of them on, is no constant of a sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.array import Array
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Hall, axes_apart, days, hidden, read
from tests.diagnose.worlds import whole

SIZE = 0.003  # deg/s/g


def _on_two_benches(hall: Hall, seed: int) -> DwellTable:
    bench = np.array(["table_A", "table_B"])[hall.run % 2]
    return replace(read(hall, seed), bench=bench)


def _named(found: UnitDiagnosis) -> set[tuple[str, str]]:
    return {(e.effect, c) for e in found.effects for c in e.channels}


def _of(hall: Hall, part: Array) -> Array:
    return np.asarray(SIZE * hall.up[:, 1] * part)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4])
def test_one_gyro_has_it_and_one_bench_makes_the_same_of_the_next(seed: int) -> None:
    """Where the Earth's rate is left out on a bench, what it was upwards looks like a g-sensitivity."""
    hall = days(seed, 5)
    table = hidden(_on_two_benches(hall, seed), "gyro", 0, _of(hall, np.ones(len(hall.run))))
    both = whole(hidden(table, "gyro", 1, _of(hall, np.ones(len(hall.run)))))
    assert _named(both) == {("g_sensitivity", "gyro_x"), ("g_sensitivity", "gyro_y")}
    found = whole(hidden(table, "gyro", 1, _of(hall, hall.run % 2 == 1)))
    assert _named(found) == {("g_sensitivity", "gyro_x")}
    assert {c for u in found.unknown for c in u.channels} <= {"gyro_y"}


@pytest.mark.parametrize("seed", [5, 6])
@pytest.mark.further("seed", [7, 8])
def test_from_one_power_on_on(seed: int) -> None:
    """Ten power-ons, warmer and colder: of five that are warmer each time it is a slope over temperature."""
    hall = days(seed, 10)
    found = whole(hidden(read(hall, seed), "gyro", 2, _of(hall, hall.run > 5)))
    assert ("g_sensitivity", "gyro_z") not in _named(found)
    assert found.verdict != "clean"


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4])
def test_beside_a_strong_effect(seed: int) -> None:
    """What a g-sensitivity makes of single power-ons, of rests or of turns, is no spread of an asymmetry."""
    hall = axes_apart(seed, 3)
    table = read(hall, seed)
    for axis in range(3):
        table = hidden(table, "gyro", axis, 0.05 * hall.up[:, axis])
    found = whole(hidden(table, "gyro", 1, 3e-4 * np.abs(hall.turn[:, 1])))
    assert ("scale_factor_asymmetry", "gyro_y") in _named(found)
    assert not found.unknown
