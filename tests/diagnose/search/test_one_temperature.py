"""At one chamber point what goes with the temperature is a name of the last resort.

Campaigns of plain NumPy: power-ons in a room whose temperature differs by half a kelvin, each in a dozen
attitudes; and power-ons at rest that warm themselves.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.worlds import DECLARED

RUNS, RECORDS, G = 10, 12, 9.80665
EARTH, LATITUDE = np.radians(15.041 / 3600.0), np.radians(48.0)


def attitudes(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) up and north in body axes, any."""
    up, north = rng.normal(size=(2, n, 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    north -= np.sum(north * up, axis=1, keepdims=True) * up
    return up, north / np.linalg.norm(north, axis=1, keepdims=True)


def rests(seed: int, per_g: float, warms: float = 0.0, goes: bool = False) -> DwellTable:
    """Gyro x with a g-sensitivity, deg/s/g along x and y at 26 degC; goes: in proportion to T − 20 °C.

    warms: deg/s of a warm-up of 250 s, of a unit that warms itself by 0.4 K with 700 s
    """
    rng = np.random.default_rng([seed, 97])
    n, run = RUNS * RECORDS, np.repeat(np.arange(RUNS), RECORDS)
    up, north = attitudes(rng, n)
    rate = EARTH * (np.sin(LATITUDE) * up + np.cos(LATITUDE) * north)
    time_on = rng.uniform(30.0, 300.0, RUNS)[run] + np.tile(60.0 * np.arange(RECORDS), RUNS)
    room = 26.0 + 0.4 * rng.normal(size=RUNS)[run]
    temperature = room + 0.4 * -np.expm1(-time_on / 700.0) + 0.01 * rng.normal(size=n)
    gyro = rate + np.radians(1e-3) * (rng.normal(size=(RUNS, 3))[run] + rng.normal(size=(n, 3)))
    changes = (temperature - 20.0) / 6.0 if goes else 1.0
    gyro[:, 0] += np.radians(per_g) * changes * (up[:, 0] + 0.7 * up[:, 1])
    gyro[:, 0] += np.radians(warms) * np.exp(-time_on / 250.0)
    return DwellTable(
        unit=np.full(n, "1"),
        run=run + 1,
        day=1.2 * run,
        time_on=time_on,
        duration=np.full(n, 10.0),
        temperature_degc=temperature,
        temperature_rate=0.4 / 700.0 * np.exp(-time_on / 700.0),
        ref_rate=rate,
        ref_acc=G * up,
        gyro=gyro,
        acc=None,
        source="rests",
    )


def names(table: DwellTable) -> set[str]:
    """Of all that is believed of the gyros."""
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, 1).found
    return {found.pool.blocks[b].name for b in found.all}


@pytest.mark.parametrize("seed", [0, 2, 7])
@pytest.mark.further("seed", [1, *range(3, 7), *range(8, 24)])
def test_a_g_sensitivity_in_a_room_is_none_over_temperature(seed: int) -> None:
    assert names(rests(seed, 2e-3)) == {"g_sensitivity"}


@pytest.mark.parametrize("seed", [0, 5, 12])
@pytest.mark.further("seed", [*range(1, 5), *range(6, 12), *range(13, 24)])
def test_a_warm_up_in_a_room_is_none_over_temperature(seed: int) -> None:
    found = names(rests(seed, 0.0, warms=8e-3))
    assert found
    assert not found & {"thermal_lag", "temperature_rate", "bias_temperature"}


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.further("seed", [2, 3, 4])
def test_what_is_seen_to_change_within_a_kelvin_goes_with_the_temperature(seed: int) -> None:
    assert names(rests(seed, 4e-2, goes=True)) == {"g_sensitivity_temperature"}
