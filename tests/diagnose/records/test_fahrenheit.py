"""Temperatures that were written in degF under a heading that says degC."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.fahrenheit import in_fahrenheit
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Hall, days, read, sweeps
from tests.diagnose.records.test_another_unit_for_a_while import rests
from tests.diagnose.worlds import whole

CHAMBER = [(-65.0, 85.0)]


def _read(hall: Hall, seed: int, there: np.ndarray) -> DwellTable:
    """The campaign with the temperatures of some rows in degF."""
    table = read(hall, seed)
    t = table.temperature_degc
    return replace(table, temperature_degc=np.where(there, 1.8 * t + 32.0, t))


@pytest.mark.parametrize("later", [True, False])
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_from_one_power_on_on_or_up_to_one(seed: int, later: bool) -> None:
    """A step of the bias and a hysteresis of one accelerometer were said of it."""
    hall = days(seed)
    there = (hall.run > 20) == later
    found = in_fahrenheit(_read(hall, seed, there), [])
    assert found is not None
    assert not found.every
    np.testing.assert_allclose(found.table.temperature_degc, hall.temperature)
    assert found.suspect.hypothesis == "mixed_units"
    assert found.suspect.value == hall.run[there][0]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_whole_file(seed: int) -> None:
    """Hotter than any chamber of the spec: without a chamber nobody knows."""
    hall = days(seed)
    table = _read(hall, seed, np.ones(len(hall.run), dtype=bool))
    found = in_fahrenheit(table, CHAMBER)
    assert found is not None
    assert found.every
    np.testing.assert_allclose(found.table.temperature_degc, hall.temperature)
    assert in_fahrenheit(table, []) is None


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_what_is_in_degc(seed: int) -> None:
    """Campaigns as they are, and one whose second half is at other points."""
    for hall in (days(seed), rests(seed), sweeps(seed)):
        assert in_fahrenheit(read(hall, seed), CHAMBER) is None
    hall, rng = days(seed), np.random.default_rng([seed, 5])
    table = read(hall, seed)
    moved = np.where(hall.run > 20, table.temperature_degc + rng.uniform(-12.0, 12.0), table.temperature_degc)
    assert in_fahrenheit(replace(table, temperature_degc=moved), CHAMBER) is None


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2])
def test_it_is_said_and_put_right(seed: int) -> None:
    hall = days(seed)
    found = whole(_read(hall, seed, hall.run > 20))
    (suspect,) = found.reference_suspects
    assert (suspect.hypothesis, suspect.value) == ("mixed_units", 21.0)
    assert not found.effects
    assert not found.unknown
    assert "degF" in suspect.check
