"""What wanders for half an hour within power-ons is no effect, and what is one stands beside it."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.array import Array
from tests.diagnose.hall import Hall, Noise, chamber, hidden, read, wander
from tests.diagnose.worlds import DECLARED

POWER_ONS, WHITE, WANDERS = 12, 4e-4, 1.2e-3  # deg/s


def _claims(seed: int, hall: Hall, effect: Array | float) -> list[tuple[str, tuple[int, ...]]]:
    """On gyros of which z wanders and has an effect (n,) beside."""
    table = read(hall, seed, gyro=Noise(WHITE, 3e-4))
    table = hidden(table, "gyro", 2, WANDERS * wander(hall, seed) + effect)
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, 1).found
    return [found.pool.blocks[b].key for b in found.all]


@pytest.mark.parametrize("seed", [2])
@pytest.mark.further("seed", [11, 25, 49])
def test_what_wanders_within_power_ons_is_nothing_else(seed: int) -> None:
    """Each of them was a hysteresis, or followed the temperature or the time of day, at 12 to 16 sigma."""
    assert _claims(seed, chamber(seed, POWER_ONS), 0.0) == []


@pytest.mark.parametrize("seed", [3])
@pytest.mark.further("seed", [25, 49])
def test_a_drift_stands_beside_what_wanders(seed: int) -> None:
    hall = chamber(seed, POWER_ONS)
    assert _claims(seed, hall, 3e-3 * hall.time_on / 3600.0) == [("drift", (2,))]


@pytest.mark.parametrize("seed", [2])
@pytest.mark.further("seed", [11, 25, 49])
def test_what_a_rate_drives_stands_beside_what_wanders(seed: int) -> None:
    hall = chamber(seed, POWER_ONS)
    assert _claims(seed, hall, 1.2e-3 * np.abs(hall.rate[:, 2]) / 45.0) == [("scale_factor_asymmetry", (2,))]
