"""Another unit that came while the last turns were made: rests are its own, most turns the first one's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.another_unit import another_unit
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import FACES, Hall, Log, Noise, read

TURNS = (-200.0, -150.0, -100.0, -20.0, 20.0, 100.0, 150.0, 200.0)
BLOCKS, EACH = (22.0, 0.0, -17.0), 8  # degC; power-ons of turns at each
FIRST = 21  # of the other unit, among those of the last block
EVERY = Noise(1e-3, 3e-4)
ACC = Noise(3e-5, 3e-4)


def _blocks(seed: int) -> Hall:
    """Power-ons of turns about one axis each, the last five of a block about the same, and rests behind."""
    rng, log = np.random.default_rng([seed, 31]), Log()
    for degc in BLOCKS:
        for k in range(EACH):
            log.day += rng.uniform(0.05, 0.1)
            log.on(rng.uniform(20.0, 60.0))
            axis = (min(k, 3) + seed) % 3
            for turn in TURNS:
                log.record(axis, 1.0, degc + 0.2 * rng.normal(), turn=turn)
    for degc in (-17.0, 0.0, 14.0, 22.0, 46.0):
        for _ in range(4):
            log.day += rng.uniform(0.05, 0.1)
            log.on(rng.uniform(20.0, 60.0))
            for i in rng.permutation(6):
                log.record(*FACES[i], degc + 0.2 * rng.normal())
    return log.hall()


def _read(hall: Hall, seed: int) -> DwellTable:
    return read(hall, seed, gyro=EVERY, acc=ACC)


def _every(table: DwellTable) -> np.ndarray:
    return np.ones(len(table), dtype=bool)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
@pytest.mark.further("seed", [5, 6, 7, 8])
def test_levels_tell_it_where_a_mounting_or_gains_would_explain_the_turns(seed: int) -> None:
    """Steps of a bias, mountings and four unknowns over days were said of it, after minutes of search."""
    hall = _blocks(seed)
    one, other, later = _read(hall, seed), _read(hall, seed + 500), (hall.run >= FIRST)[:, None]
    assert one.gyro is not None
    assert one.acc is not None
    assert other.gyro is not None
    assert other.acc is not None
    table = replace(one, gyro=np.where(later, other.gyro, one.gyro), acc=np.where(later, other.acc, one.acc))
    found = another_unit(table, _every(table))
    assert found is not None
    assert found.suspect.value == FIRST


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
@pytest.mark.further("seed", [5, 6, 7, 8])
def test_a_unit_that_stays_mounted_anew_or_shocked_on_one_sensor(seed: int) -> None:
    """A mounting leaves the gyros' biases, a shock of the accelerometers theirs."""
    hall, rng = _blocks(seed), np.random.default_rng([seed, 32])
    later = hall.run >= FIRST
    theta = np.where(later[:, None], np.radians(0.2) * rng.normal(size=3), 0.0)
    turned = replace(hall, **{k: v + np.cross(theta, v) for k, v in _of(hall).items()})
    plain = _read(hall, seed)
    assert plain.acc is not None
    shocked = replace(plain, acc=plain.acc + np.where(later[:, None], 0.05 * rng.normal(size=3), 0.0))
    for table in (plain, read(hall, seed, felt=turned, gyro=EVERY, acc=ACC), shocked):
        assert another_unit(table, _every(table)) is None


def _of(hall: Hall) -> dict[str, np.ndarray]:
    return {"up": hall.up, "north": hall.north, "turn": hall.turn}


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_behind_a_few_power_ons_of_another_unit_all_levels_step_back(seed: int) -> None:
    """Rests at a temperature that they and those right behind them have: not all behind is another's."""
    rng, log = np.random.default_rng([seed, 33]), Log()
    for degc, visits in ((-49.0, 6), (28.0, 6), (3.0, 6), (13.0, 6), (20.0, 6), (30.0, 6)):
        for _ in range(visits):
            log.day += rng.uniform(0.05, 0.1)
            log.on(rng.uniform(20.0, 60.0))
            for i in rng.permutation(6):
                log.record(*FACES[i], degc + 0.2 * rng.normal())
            if degc == -49.0:
                for axis in range(3):
                    for turn in (-100.0, 100.0):
                        log.record(axis, 1.0, degc, turn=turn)
    hall, few = log.hall(), range(19, 23)
    one, other = _read(hall, seed), _read(hall, seed + 500)
    assert one.gyro is not None
    assert one.acc is not None
    assert other.gyro is not None
    assert other.acc is not None
    there = np.isin(hall.run, few)[:, None]
    table = replace(one, gyro=np.where(there, other.gyro, one.gyro), acc=np.where(there, other.acc, one.acc))
    found = another_unit(table, _every(table))
    assert found is not None
    np.testing.assert_array_equal(found.kept, ~there[:, 0])
