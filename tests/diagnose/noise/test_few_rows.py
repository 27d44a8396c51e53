"""Hundred rows, or a dozen power-ons: noise is known as well as what stands beside it lets them tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.noise.components import LEVEL
from planner.diagnose.search.sensor import SensorFound, begin, diagnose_sensor
from planner.dwells.table_rows import rows_of
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import ACC, GYRO, G, Hall, Noise, axes_apart, days, hidden, read
from tests.diagnose.labs.shapes import Hidden
from tests.diagnose.labs.unit import campaign
from tests.diagnose.noise.test_small_campaigns import claims
from tests.diagnose.worlds import DECLARED

BUDGET = Noise(1e-4, 2.5e-3, 2e-5)  # run-to-run as small_uav.yaml has it of gyros


def searched(table: DwellTable) -> SensorFound:
    return diagnose_sensor(prepared(replace(table, acc=None)), "gyro", DECLARED, 1)


def some(table: DwellTable, power_ons: int) -> DwellTable:
    """Evenly chosen power-ons."""
    runs = np.unique(table.run)
    kept = np.unique(np.linspace(0, len(runs) - 1, power_ons).round().astype(int))
    return rows_of(table, np.isin(table.run, runs[kept]))


@pytest.mark.parametrize(
    ("seed", "name", "power_ons"),
    [(97001, "ageing", 24), (97002, "ageing", 30), (97003, "ageing", 30), (97002, "g_sensitivity", 24)],
)
def test_what_hides_among_two_hundred_rows_is_seen(seed: int, name: str, power_ons: int) -> None:
    """At 12 to 20 sigma nothing was said: under 80 columns the noise was known by one degree of freedom."""
    table, _ = campaign(seed, Hidden(name, f"gyro_{'xyz'[seed % 3]}", 30.0))
    assert claims(searched(some(table, power_ons))) == [(name, (seed % 3,))]


def a_dozen(seed: int) -> Hall:
    return days(seed, 12)


@pytest.mark.parametrize("seed", [97011, 97012, 97013])
def test_what_ages_is_seen_by_a_dozen_power_ons(seed: int) -> None:
    """Fewer than twenty were said to be too few to tell their spread: 24 sigma of it were untestable."""
    hall = a_dozen(seed)
    s = searched(hidden(read(hall, seed), "gyro", seed % 3, 2.0 * GYRO.level * hall.day))
    assert claims(s) == [("ageing", (seed % 3,))]
    noise = s.found.pool.state[seed % 3].noise
    level = noise.components.index(LEVEL)
    assert np.sqrt(noise.variances.theta[level]) == pytest.approx(np.radians(GYRO.level), rel=0.5)
    assert 2.0 / noise.relative_error[level, level] > 6.0  # of 12 power-ons at five temperatures


@pytest.mark.parametrize("times", [3.0, 8.0])
@pytest.mark.parametrize("layout", [axes_apart, a_dozen])
def test_scatter_of_several_budgets_is_no_claim(layout: Callable[[int], Hall], times: float) -> None:
    for seed in (97021, 97022):
        noise = Noise(BUDGET.white, times * BUDGET.level, times * BUDGET.scale)
        assert claims(searched(read(layout(seed), seed, noise))) == []


@pytest.mark.parametrize("seed", range(97011, 97015))
def test_the_levels_of_six_power_ons_are_no_noise_of_their_records(seed: int) -> None:
    """Four faces each, too few for all candidates: the level, six times the white noise, went into it.

    The plan's own campaign of `small_uav`, six power-ons, then said that an accelerometer exceeds its budget.
    """
    hall = days(seed, 6)
    read_at = replace(hall, temperature=np.repeat([-45.0, 20.0, 60.0] * 2, 18))
    four = np.flatnonzero(~hall.turns)[np.arange(36) % 6 > 1]
    pool = begin(prepared(rows_of(read(read_at, seed), four)), "accelerometer", DECLARED).pool
    for w in pool.state.values():
        assert float(np.mean(w.noise.spread)) == pytest.approx(ACC.white * G, rel=0.5)
