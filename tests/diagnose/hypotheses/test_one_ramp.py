"""One power-on in which the chamber goes up and down, beside many that soak: its branches are its repeats."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Hall, Log, hidden, read
from tests.diagnose.worlds import whole

SOAKS = (-40.0, -10.0, 20.0, 50.0)
SPEED, RECORDS, HELD = 2.0, 24, 8  # K/min; on each branch, and before it
SIZE = {"gyro": 2e-3, "acc": 1e-3}  # deg/s, g per K/min


def _one_ramp(seed: int, visits: int = 3) -> Hall:
    """Soaks with faces and turns, a power-on each, then one at rest up from the coldest and back."""
    rng, log = np.random.default_rng([seed, 61]), Log()
    for _ in range(visits):
        for degc in rng.permutation(SOAKS):
            log.on(rng.uniform(8.0, 50.0))
            log.on_the_table(rng, degc)
            log.day += 0.3
    log.on(rng.uniform(8.0, 50.0))
    axis = int(rng.integers(3))
    wait = (SOAKS[-1] - SOAKS[0]) / SPEED * 60.0 / RECORDS - 55.0
    for way, begin in ((1.0, SOAKS[0]), (-1.0, SOAKS[-1])):
        for _ in range(HELD):
            log.record(axis, 1.0, begin)
        start = log.t
        for _ in range(RECORDS):
            degc = begin + way * SPEED * (log.t + 30.0 - start) / 60.0
            log.record(axis, 1.0, degc, ramp=way * SPEED)
            log.t += wait
    return log.hall()


@cache
def _with(seed: int, sensor: str, up: float, down: float) -> DwellTable:
    """A table with what goes with dT/dt on channel y, times `up` and `down` on either branch."""
    hall = _one_ramp(seed)
    of: Array = np.where(hall.ramp > 0.0, up, down)
    return hidden(read(hall, seed), sensor, 1, SIZE[sensor] * of * hall.ramp)


@pytest.mark.parametrize(("seed", "sensor"), [(1, "gyro"), (2, "acc")])
@pytest.mark.further(("seed", "sensor"), [(3, "gyro"), (4, "acc"), (5, "gyro"), (6, "acc")])
def test_what_both_branches_of_the_only_ramp_have_is_named(seed: int, sensor: str) -> None:
    """It was refused, as it rests on one power-on, and nothing was missing: soaks cannot tell it."""
    found = whole(_with(seed, sensor, 1.0, 1.0))
    (effect,) = found.effects
    assert effect.effect == "temperature_rate"
    assert effect.channels == ("gyro_y" if sensor == "gyro" else "accelerometer_y",)
    assert any("alone can tell temperature_rate" in note for note in found.notes)
    (term,) = effect.terms
    true = SIZE[sensor] * (np.radians(1.0) if sensor == "gyro" else 9.80665) * 60.0
    assert abs(term.value - true) < term.high - term.low  # twice the 95 %


@pytest.mark.parametrize(("seed", "sensor"), [(11, "gyro")])
@pytest.mark.further(("seed", "sensor"), [(12, "acc"), (13, "gyro"), (14, "acc")])
def test_what_one_branch_alone_has_is_no_effect_of_the_rate(seed: int, sensor: str) -> None:
    found = whole(_with(seed, sensor, 1.0, 0.0))
    assert all(e.effect != "temperature_rate" for e in found.effects)


@pytest.mark.parametrize("seed", [21])
@pytest.mark.further("seed", [22, 23, 24])
def test_a_ramp_in_which_nothing_is_hidden_says_nothing(seed: int) -> None:
    found = whole(read(_one_ramp(seed), seed))
    assert not found.effects
    assert not found.unknown
