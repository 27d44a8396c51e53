"""A bias that walks over the days as far as the spec's storage lets it is no trend and no step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.hypotheses.refusals import STORED
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hypotheses.hall import Hall, Noise, days, hidden, read
from tests.specs import shipped

SPEC = shipped("small_uav").spec
STORAGE = 1e-3  # deg/s in 60 days, as it has
QUIET = Noise(2e-4, 3e-4)  # whose power-ons show the walk well


def _walk(hall: Hall, seed: int) -> Array:
    """(n,) deg/s, a random walk from power-on to power-on."""
    rng, at = np.random.default_rng([seed, 51]), np.unique(hall.run, return_inverse=True)[1]
    day = np.array([hall.day[hall.run == r][0] for r in np.unique(hall.run)])
    step = STORAGE * np.sqrt(np.diff(day, prepend=day[0]) / 60.0) * rng.normal(size=len(day))
    return np.asarray(np.cumsum(step)[at])


def _stored(seed: int, trend: float = 0.0) -> DwellTable:
    """Gyros of which each walks; one has a trend beside it, deg/s a day."""
    hall = days(seed, 24)
    table = replace(read(hall, seed, gyro=QUIET), acc=None)
    for axis in range(3):
        table = hidden(table, "gyro", axis, _walk(hall, 10 * seed + axis))
    return hidden(table, "gyro", seed % 3, trend * hall.day)


@pytest.mark.parametrize("seed", [4, 8, 1, 2])
def test_a_walk_within_its_budget_is_no_trend(seed: int) -> None:
    """It was a trend or a step at five sigma, which the calibration's fit told at three."""
    found = diagnose(_stored(seed), SPEC)
    assert not found.effects
    assert not found.unknown


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_trend_far_beyond_it_is_named(seed: int) -> None:
    found = diagnose(_stored(seed, 6e-4), SPEC)
    assert [(e.effect, e.channels) for e in found.effects] == [("ageing", ("gyro_" + "xyz"[seed % 3],))]
    assert not any(r.why == STORED and r.channels == found.effects[0].channels for r in found.refused)
