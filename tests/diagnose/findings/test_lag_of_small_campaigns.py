"""A thermometer that lags by minutes on a few ramps: one lag of several channels, not an effect of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.findings.lagging_thermometer import Lag, lags_more
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.diagnosis import UnitDiagnosis
from planner.protocols import SENSORS
from tests.diagnose.hall import Noise, hidden, read, short_ramps, wander
from tests.diagnose.worlds import DECLARED, whole

QUIET = Noise(2e-4, 6e-4)


def _lagging(seed: int, minutes: float) -> UnitDiagnosis:
    hall = short_ramps(seed)
    return whole(
        read(hall, seed, gyro=QUIET, felt=replace(hall, temperature=hall.temperature + minutes * hall.ramp))
    )


@pytest.mark.parametrize(("seed", "minutes"), [(1, 4.0), (2, 6.0), (4, 2.5)])
@pytest.mark.further(("seed", "minutes"), [(3, 5.0), (5, 3.5)])
def test_the_thermometer_is_named_and_no_channel(seed: int, minutes: float) -> None:
    """Effects of the rate of temperature on up to five channels before; a lag 20 % short of the true one."""
    found = _lagging(seed, minutes)
    (lag,) = found.reference_suspects
    assert lag.hypothesis == "thermometer_lag"
    assert lag.value == pytest.approx(60.0 * minutes, rel=0.06)
    assert not found.effects
    assert not found.unknown


@pytest.mark.parametrize("seed", [60, 62])
@pytest.mark.further("seed", [63])
def test_a_lag_that_no_channel_follows_visibly_is_told_by_all_together(seed: int) -> None:
    """Nothing was missing, at 10 to 30 sigma: linear columns beside a table's nodes see none of it."""
    hall = short_ramps(seed)
    lagging = replace(hall, temperature=hall.temperature + 1.5 * hall.ramp)
    found = whole(read(hall, seed, gyro=Noise(1e-3, 6e-4), felt=lagging))
    (lag,) = found.reference_suspects
    assert lag.hypothesis == "thermometer_lag"
    assert lag.low - 4.0 <= 90.0 <= lag.high + 4.0
    assert len(lag.channels) > 1
    assert not found.effects


@pytest.mark.parametrize("seed", [4])
@pytest.mark.further("seed", [5, 8])
def test_a_lag_has_its_size_where_all_channels_wander(seed: int) -> None:
    """Walks of half an hour are no curves that lag: by white noise 129 +- 7 s, 127 +- 5 s."""
    hall = short_ramps(seed, 8)
    table = read(hall, seed, gyro=QUIET, felt=replace(hall, temperature=hall.temperature + 2.0 * hall.ramp))
    for axis in range(3):
        table = hidden(table, "gyro", axis, 1.5e-3 * wander(hall, 10 * seed + axis))
        table = hidden(table, "acc", axis, 3e-4 * wander(hall, 10 * seed + axis + 5))
    (lag,) = whole(table).reference_suspects
    assert lag.low <= 120.0 <= lag.high


@pytest.mark.parametrize("seed", [1, 2])
def test_what_lags_more_than_one_power_on_is_off_is_no_temperature_of_that_one(seed: int) -> None:
    hall = short_ramps(seed)
    late = replace(hall, temperature=hall.temperature + 4.0 * hall.ramp)
    data = [prepared(read(hall, seed, gyro=QUIET, felt=felt)) for felt in (late, hall)]
    lags, prompt = ([diagnose_sensor(d, s, DECLARED, 1) for s in SENSORS] for d in data)
    assert lags_more(lags, data[0], 5.0)
    assert not lags_more(lags, data[0], 1e4)
    assert not lags_more(prompt, data[1], 5.0)


@pytest.mark.parametrize(
    ("falls", "apart", "several"),
    [
        ((0.3, 900.0, -2.0, 4.0, 1.0, 0.0), (0.0,) * 6, False),  # one channel by itself
        ((6.0, 2.0, 9.0, 3.0, 7.0, 5.0), (0.0, 1.0, 0.5, 2.0, 0.0, 0.1), True),  # a little by each
        ((40.0, 200.0, 30.0, -25.0, 1.0, 2.0), (0.0,) * 6, False),  # one becomes worse
        ((60.0, 200.0, 30.0, 1.0, 1.0, 2.0), (90.0, 0.0, 40.0, 0.0, 0.0, 0.0), False),  # each another lag
    ],
)
def test_a_lag_is_one_where_channels_say_it_together(
    falls: tuple[float, ...], apart: tuple[float, ...], several: bool
) -> None:
    names = (f"{sensor}_{axis}" for sensor in ("gyro", "accelerometer") for axis in "xyz")
    lag = Lag(90.0, 80.0, 100.0, dict(zip(names, falls, strict=True)), np.array(apart))
    assert lag.of_several == several


@pytest.mark.parametrize("seed", [6, 7])
@pytest.mark.further("seed", [8, 9])
def test_what_one_channel_lags_by_stays_its_own(seed: int) -> None:
    hall = short_ramps(seed, 6)
    behind = hall.ramp * (1.0 - np.exp(-hall.time_on / 150.0))
    found = whole(hidden(read(hall, seed, gyro=QUIET), "gyro", 2, 5e-3 * behind))
    assert not found.reference_suspects
    assert {c for e in found.effects for c in e.channels} | {
        c for u in found.unknown for c in u.channels
    } == {"gyro_z"}


@pytest.mark.parametrize("seed", [10, 11])
@pytest.mark.further("seed", [12])
def test_ramps_with_a_prompt_thermometer_are_clean(seed: int) -> None:
    assert whole(read(short_ramps(seed, 6), seed, gyro=QUIET)).verdict == "clean"


def test_the_interval_of_a_lag_has_the_truth() -> None:
    """A parabola over two hundred seconds put it up to nine half widths off."""
    off = []
    for seed in range(20, 26):
        (lag,) = _lagging(seed, 4.0).reference_suspects
        off.append(abs(lag.value - 240.0) / ((lag.high - lag.low) / 2.0))
    assert np.count_nonzero(np.array(off) > 1.0) <= 1
