"""A step that leaves a channel less spread than the others of its triad have is the draw of its power-ons."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from tests.diagnose.hall import Noise, days, hidden, read
from tests.diagnose.worlds import DECLARED

POWER_ONS, FIRST = 12, 4
LEVEL = 1e-3  # deg/s, of the other channels


def _claims(seed: int, step: float) -> list[tuple[str, tuple[int, ...]]]:
    """Gyro x: a step of so many LEVEL, and a twentieth of one beside; y and z: power-ons drawn of LEVEL."""
    hall = days(seed, POWER_ONS)
    rng = np.random.default_rng([seed, 21])
    table = read(hall, seed, gyro=Noise(2e-4, 0.0))
    run = np.unique(hall.run, return_inverse=True)[1]
    for axis in range(3):
        own = 0.05 * rng.normal(size=POWER_ONS) + step * (np.arange(POWER_ONS) < FIRST)
        level = own if axis == 0 else rng.normal(size=POWER_ONS)
        table = hidden(table, "gyro", axis, LEVEL * level[run])
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, 1).found
    return [found.pool.blocks[b].key for b in found.all]


@pytest.mark.parametrize("seed", range(1, 6))
def test_what_the_draw_of_power_ons_may_be_is_no_step(seed: int) -> None:
    assert _claims(seed, 1.8) == []


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4, 5])
def test_a_step_of_many_draws_is_one(seed: int) -> None:
    (claim,) = _claims(seed, 12.0)
    assert claim == ("bias_step", (0,))
