"""Another unit in a few power-ons of rests in turn, with a temperature of their own or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.another_unit import another_unit
from planner.diagnose.records.another_unit_at_rest import few_at_rest
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import FACES, G, Hall, Log, read

VISITS = 4
DEGC = (-39.0, 8.0, 15.0, 27.0, 54.0)
ALONE = range(9, 13)  # all that were at 15 degC
AMONG = range(6, 8)  # two of four at 8 degC
TILTED = np.array([[2.0, -2.0, 1.0], [1.0, 2.0, 2.0], [-2.0, -1.0, 2.0]]) / 3.0  # no face is a face


def rests(seed: int) -> Hall:
    """Turns at 27 degC, then four power-ons of six faces at each of five temperatures, in turn."""
    rng, log = np.random.default_rng([seed, 8]), Log()
    log.on(30.0)
    for axis in range(3):
        for turn in (-200.0, -50.0, 50.0, 200.0):
            log.record(axis, 1.0, 27.0, turn=turn)
    for degc in DEGC:
        for _ in range(VISITS):
            log.day += rng.uniform(0.1, 0.3)
            log.on(rng.uniform(20.0, 60.0))
            for i in rng.permutation(6):
                log.record(*FACES[i], degc + 0.2 * rng.normal())
    hall = log.hall()
    return replace(hall, run=hall.run - 1)


def of(hall: Hall, seed: int, runs: Sequence[int]) -> DwellTable:
    """The readings of another unit in some power-ons."""
    one, other, there = read(hall, seed), read(hall, seed + 1000), np.isin(hall.run, runs)[:, None]
    assert one.gyro is not None
    assert one.acc is not None
    assert other.gyro is not None
    assert other.acc is not None
    return replace(one, gyro=np.where(there, other.gyro, one.gyro), acc=np.where(there, other.acc, one.acc))


def every(table: DwellTable) -> np.ndarray:
    return np.ones(len(table), dtype=bool)


@pytest.mark.parametrize("runs", [ALONE, AMONG])
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_a_few_power_ons_of_another_unit(seed: int, runs: range) -> None:
    """A table over the rate of temperature was made of what ramps through theirs say."""
    table = of(rests(seed), seed, runs)
    found = another_unit(table, every(table))
    assert found is not None
    assert found.suspect.hypothesis == "mixed_units"
    assert found.suspect.value == runs[0]
    np.testing.assert_array_equal(found.kept, ~np.isin(table.run, runs))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_what_is_no_other_unit(seed: int) -> None:
    """A mounting turns all channels alike, a base leans them alike."""
    hall = rests(seed)
    there = np.isin(hall.run, ALONE)[:, None]
    turned = hall.up + np.where(there, np.cross(np.radians([0.2, -0.3, 0.15]), hall.up), 0.0)
    leaned = hall.up + np.where(there, np.radians(0.3) * hall.north, 0.0)
    plain = read(hall, seed)
    assert another_unit(plain, every(plain)) is None
    for up in (turned, leaned):
        table = read(hall, seed, felt=replace(hall, up=up))
        assert another_unit(table, every(table)) is None


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
@pytest.mark.further("seed", [5, 6, 7, 8])
def test_leans_that_go_with_the_temperature(seed: int) -> None:
    """By a cubic of it, as large as 0.1 deg: no few power-ons have what the others have not."""
    hall = rests(seed)
    table, rng, x = read(hall, seed), np.random.default_rng([seed, 9]), (hall.temperature - 5.0) / 60.0
    still = ~hall.turns
    assert table.acc is not None
    assert table.ref_acc is not None
    leans = [rng.normal(0.0, s, (3, 3)) * (1.0 - np.eye(3)) for s in (1e-3, 5e-4, 3e-4)]
    acc = table.acc + sum((x**k)[:, None] * (hall.up @ m.T) * G for k, m in enumerate(leans, start=1))
    run = hall.run[still] - 1
    asked = acc[still], table.ref_acc[still], run, hall.north[still], hall.temperature[still]
    assert few_at_rest(*asked) is None
    other = of(hall, seed, ALONE).acc
    assert other is not None
    there = np.isin(hall.run, ALONE)[:, None]
    found = few_at_rest(np.where(there, other, acc)[still], *asked[1:])
    assert found is not None
    np.testing.assert_array_equal(found[1], np.array(ALONE) - 1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_face_of_their_own_is_no_lean(seed: int) -> None:
    """What an accelerometer adds where all axes are loaded shows in those that stood so."""
    hall = rests(seed)
    there = np.isin(hall.run, ALONE)[:, None]
    hall = replace(hall, up=np.where(there, hall.up @ TILTED.T, hall.up))
    plain = read(hall, seed)
    assert plain.acc is not None
    lean = np.random.default_rng([seed, 10]).normal(0.0, 5e-3, (3, 3)) * (1.0 - np.eye(3))
    table = replace(plain, acc=plain.acc + there * (hall.up @ lean.T) * G)
    assert another_unit(table, every(table)) is None
