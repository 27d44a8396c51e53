"""One power-on whose levels are off on all channels: it is left out as a whole, and widens no spread."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import axes_apart, days, hidden, read
from tests.diagnose.labs.unit import campaign
from tests.diagnose.worlds import whole


def _shocked(table: DwellTable, run: int, seed: int, channels: int = 6, times: float = 1.0) -> DwellTable:
    """All biases others by 10 to 20 times what power-ons draw, in one of them."""
    rng, here = np.random.default_rng([seed, 91]), (table.run == run).astype(float)
    for k in range(channels):
        size = times * rng.choice([-1.0, 1.0]) * rng.uniform(10.0, 20.0) * (1e-3, 8e-4)[k % 2]
        table = hidden(table, ("gyro", "acc")[k % 2], k // 2, size * here)
    return table


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4, 5])
def test_a_unit_that_was_shocked_in_one_power_on(seed: int) -> None:
    """Its budgets were exceeded, and that was all: its records agree with each other."""
    hall = days(seed, 36)
    run = 14 + seed
    found = whole(_shocked(read(hall, seed), run, seed))
    assert {row.run for row in found.rows_left_out} == {run}
    assert [(s.hypothesis, s.value) for s in found.reference_suspects] == [("mixed_units", run)]
    assert not found.effects
    assert not found.unknown
    assert not found.budget_exceeded


@pytest.mark.parametrize("seed", [2])
def test_either_of_two_that_alone_have_a_temperature(seed: int) -> None:
    hall = days(seed, 24)
    alone = [r for r in np.unique(hall.run) if np.abs(hall.temperature[hall.run == r][0] - 40.0) < 3.0]
    assert alone == [4, 11]
    found = whole(_shocked(read(hall, seed), 11, seed, times=2.0))
    assert {row.run for row in found.rows_left_out} == {4, 11}
    assert any("or run 4 is" in row.guess for row in found.rows_left_out)
    assert not found.budget_exceeded


@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12, 13])
def test_of_two_channels_it_is_the_units_own(seed: int) -> None:
    """Two biases that both jump at one power-on are its turn-on change, of whatever law."""
    hall = days(seed, 24)
    found = whole(_shocked(read(hall, seed), 10, seed, channels=2))
    assert not found.rows_left_out


@pytest.mark.parametrize(("seed", "tails"), [(22, 2.5)])
@pytest.mark.further(("seed", "tails"), [(21, 0.0), (23, 2.5), (24, 0.0)])
def test_no_level_is_off_of_a_plain_campaign(seed: int, tails: float) -> None:
    table, _ = campaign(seed, tails=tails)
    assert not whole(table).reference_suspects


@pytest.mark.parametrize("seed", [31])
@pytest.mark.further("seed", [32])
def test_levels_of_wide_spreads_are_those_of_the_unit(seed: int) -> None:
    """Every third power-on of turns draws five times as much: that is how the unit is."""
    hall = axes_apart(seed, 4)
    rng, table = np.random.default_rng([seed, 92]), read(hall, seed)
    which = np.unique(hall.run, return_inverse=True)[1]
    level = 5e-3 * rng.normal(size=(which.max() + 1, 3)) * (rng.random(which.max() + 1) < 0.33)[:, None]
    assert table.gyro is not None
    found = whole(replace(table, gyro=table.gyro + np.radians(level[which])))
    assert not found.rows_left_out


@pytest.mark.parametrize("seed", [31])
@pytest.mark.further("seed", [32, 33, 34])
def test_one_channel_that_was_shocked_beyond_any_draw(seed: int) -> None:
    """An accelerometer that was off by 20 mg in one power-on of 36 had its budget exceeded, no more."""
    hall, run = days(seed, 36), 5 + seed % 7
    here = (hall.run == run).astype(float)
    found = whole(hidden(read(hall, seed), "acc", 1, 0.02 * here))
    assert {(row.run, row.channel) for row in found.rows_left_out} == {(run, "accelerometer_y")}
    assert all("accelerometer y alone" in row.guess for row in found.rows_left_out)
    assert not found.budget_exceeded
    assert not found.effects


@pytest.mark.parametrize("seed", [41])
@pytest.mark.further("seed", [42])
def test_one_channel_that_draws_much_is_noisy(seed: int) -> None:
    """Levels with tails, and a spread six times the budget: no power-on of it stands alone."""
    hall, rng = days(seed, 36), np.random.default_rng([seed, 92])
    drawn = 3e-3 * rng.standard_t(4.0, hall.run.max() + 1)[hall.run]
    found = whole(hidden(read(hall, seed), "acc", 1, drawn))
    assert not found.rows_left_out
    assert found.budget_exceeded
