"""Ramps from end to end of the temperatures, with soaks at the ends alone: bends of a curve are no lag."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.findings.lagging_thermometer import degree_asked, degree_of, seen_of
from planner.diagnose.records.temperature_of_before import temperature_of_before
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.protocols import SENSORS
from tests.diagnose.hall import FACES, Hall, Log, Noise, read, short_ramps
from tests.diagnose.worlds import DECLARED, whole

GYRO = Noise(4e-4, 1e-3)
SPEED = 1.0  # K/min
ENDS = (-40.0, 60.0)


def _end_to_end(seed: int, power_ons: int = 12, records: int = 36) -> Hall:
    """Ramps up and down in turn, half of them with a soak behind them; attitudes and turns in all."""
    rng, log = np.random.default_rng([seed, 21]), Log()
    wait = (ENDS[1] - ENDS[0]) / SPEED * 60.0 / records - 55.0  # s between records
    for k in range(power_ons):
        log.on(rng.uniform(10.0, 60.0))
        way, start, begins = (1.0, -1.0)[k % 2], ENDS[k % 2], log.t
        for i in range(records):
            soaks = k % 4 < 2 and i > 0.85 * records
            degc = ENDS[1 - k % 2] if soaks else start + way * SPEED * (log.t + 30.0 - begins) / 60.0
            axis, sign = FACES[rng.integers(6)]
            turn = float(rng.choice([-100.0, -50.0, 50.0, 100.0])) if i % 3 == 2 else 0.0
            log.record(axis, sign, degc, 0.0 if soaks else way * SPEED, turn)
            log.t += wait
        log.day += rng.uniform(0.2, 0.6)
    return log.hall()


def _behind(hall: Hall, tau: float) -> Array:
    """(n,) degC of a thermometer of first order whose ramp begins with the power-on."""
    return hall.temperature - tau * hall.ramp / 60.0 * (1.0 - np.exp(-hall.time_on / tau))


def _read_behind(seed: int, tau: float) -> DwellTable:
    hall = _end_to_end(seed)
    return read(replace(hall, temperature=_behind(hall, tau)), seed, gyro=GYRO, felt=hall)


def _asked(hall: Hall, seed: int) -> tuple[int, int]:
    """Degrees of the curves that soaked points tell, and of those that all channels ask for."""
    data = prepared(read(hall, seed, gyro=GYRO))
    found = [diagnose_sensor(data, sensor, DECLARED, 1) for sensor in SENSORS]
    seen = [seen_of(s, axis) for s in found for axis in s.found.pool.state]
    return degree_of(data.table), degree_asked(seen, data.table, 120.0)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4])
def test_the_rows_of_long_ramps_tell_the_bends_of_a_curve(seed: int) -> None:
    """Beside straight lines from end to end they were a lag of five minutes, and effects of four channels."""
    soaked, asked = _asked(_end_to_end(seed), seed)
    assert soaked == 1
    assert asked >= 3  # the units' curves are cubics
    found = whole(read(_end_to_end(seed), seed, gyro=GYRO))
    assert not found.reference_suspects
    assert not found.effects
    assert not found.unknown


@pytest.mark.parametrize("seed", [1])
def test_a_lag_is_no_bend_where_the_soaked_points_tell_the_curve(seed: int) -> None:
    hall = short_ramps(seed)
    soaked, asked = _asked(hall, seed)
    assert soaked == asked == 3


@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12, 13, 14])
def test_a_lag_is_no_thermometer_that_is_read_a_record_late(seed: int) -> None:
    """It was as long as from record to record, 167 s and not one more or less, where it was 120 s."""
    table = _read_behind(seed, 120.0)
    assert temperature_of_before(table) is None
    (lag,) = whole(table).reference_suspects
    assert lag.hypothesis == "thermometer_lag"
    assert lag.low - 3.0 <= 120.0 <= lag.high + 3.0
