"""A chamber that was not soaked, or a column of set points, is said; no warm-up of a sensor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Hall, days, hidden, read
from tests.diagnose.worlds import whole

TAU_S = 450.0


def _warmer(hall: Hall, by: np.ndarray) -> Hall:
    """What the unit is exposed to that was warmer by (n,) K when its power-on began."""
    return replace(hall, temperature=hall.temperature + by * np.exp(-hall.time_on / TAU_S))


@pytest.mark.parametrize(("seed", "by"), [(1, 18.0)])
@pytest.mark.further(("seed", "by"), [(2, -12.0), (3, 25.0), (4, -20.0)])
def test_some_power_ons_that_were_not_soaked(seed: int, by: float) -> None:
    """Warm-ups and drifts over temperature of several channels were said of them."""
    hall = days(seed, 24)
    there = np.isin(hall.run, np.random.default_rng([seed, 81]).choice(24, size=8, replace=False) + 1)
    found = whole(read(hall, seed, felt=_warmer(hall, by * there)))
    assert not found.effects
    assert not found.unknown
    (suspect,) = found.reference_suspects
    assert (suspect.hypothesis, suspect.unit) == ("thermometer_lag", "s")
    assert suspect.low <= TAU_S <= suspect.high
    runs = suspect.check.split("in run ")[1].split(" and others")[0]
    assert {int(r) for r in runs.split(", ")} <= set(np.unique(hall.run[there]).tolist())


@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12, 13, 14])
def test_set_points_that_the_unit_had_not_come_to(seed: int) -> None:
    """It comes from the room, by a share that differs from one power-on to the next."""
    hall = days(seed, 24)
    points = replace(hall, temperature=5.0 * np.round(hall.temperature / 5.0))
    share = np.random.default_rng([seed, 82]).uniform(0.1, 0.4, hall.run.max() + 1)[hall.run]
    found = whole(read(points, seed, felt=_warmer(points, share * (20.0 - points.temperature))))
    assert not found.effects
    assert [s.hypothesis for s in found.reference_suspects] == ["thermometer_lag"]


def _of_one_channel(hall: Hall, seed: int) -> DwellTable:
    return hidden(read(hall, seed), "acc", 1, 2e-3 * np.exp(-hall.time_on / TAU_S))


def _of_itself(hall: Hall, seed: int) -> DwellTable:
    return read(hall, seed, felt=_warmer(hall, np.full(len(hall.run), 10.0)))


@pytest.mark.parametrize("told", [_of_one_channel, _of_itself])
@pytest.mark.parametrize("seed", [21])
@pytest.mark.further("seed", [22, 23])
def test_a_unit_that_warms_up_alike_every_time_was_soaked(
    told: Callable[[Hall, int], DwellTable], seed: int
) -> None:
    """That is its own doing, whether one channel follows it or all do."""
    found = whole(told(days(seed, 24), seed))
    assert not found.reference_suspects
    assert any(e.effect in ("warm_up", "drift_curve_temperature", "settling", "drift_curve_over_temperature")
               for e in found.effects) or found.unknown  # fmt: skip


@pytest.mark.parametrize("seed", [33])
@pytest.mark.further("seed", [32, 34])
def test_a_rate_that_drifts_is_no_temperature_of_the_gyros_alone(seed: int) -> None:
    """They said 50 K of it, and what that made of the accelerometers was a lag of one of them."""
    hall = days(seed, 28)
    drifts = 1.0 + 3e-3 * (hall.day - hall.day.min()) / np.ptp(hall.day)
    found = whole(read(hall, seed, felt=replace(hall, turn=hall.turn * drifts[:, None])))
    assert not found.effects
    assert {s.hypothesis for s in found.reference_suspects} == {"table_rate"}
