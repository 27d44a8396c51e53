"""A table whose rate is another one in every power-on, or from some on: the gyros scatter together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.records.scale_of_power_ons import (
    Shares,
    gravity_of_power_ons,
    table_rate_of_power_ons,
)
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import FACES, Hall, Log, Noise, days, hidden, read
from tests.specs import shipped

SPEC = shipped("small_uav").spec
SCATTER = 3e-4
DRAWN = Noise(4e-4, 1e-3, scale=2e-5)


def _table(seed: int, by: np.ndarray) -> DwellTable:
    """Power-ons in which the table turns by a share (g,) faster than it says."""
    hall = days(seed, 24)
    return read(
        hall, seed, gyro=DRAWN, felt=replace(hall, turn=hall.turn * (1.0 + by[hall.run - 1])[:, None])
    )


def _told(table: DwellTable) -> Shares | None:
    data = prepared(table, SPEC.unit)
    return table_rate_of_power_ons([diagnose_sensor(data, "gyro", tuple(SPEC.effects), 1)], data, [])


@pytest.mark.parametrize("seed", [301])
@pytest.mark.further("seed", [302, 303, 304])
def test_gyros_that_scatter_together_are_a_table(seed: int) -> None:
    """Silent where the noise of each gyro had it as a spread of its scale factor."""
    shares = SCATTER * np.random.default_rng(seed).normal(size=24)
    found = diagnose(_table(seed, shares), SPEC)
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "table_rate"
    assert "from power-on to power-on" in suspect.check
    assert abs(suspect.value - SCATTER) < 0.5 * SCATTER  # a spread of 19 degrees of freedom: 16 %
    assert (found.effects, found.unknown) == ((), ())
    assert not found.budget_exceeded


@pytest.mark.parametrize("seed", [311])
@pytest.mark.further("seed", [312, 313, 314])
def test_a_step_of_the_table_has_its_place_and_its_size(seed: int) -> None:
    told = _told(_table(seed, np.where(np.arange(24) >= 11, 9e-4, 0.0)))
    assert told is not None
    assert told.first == 12
    assert abs(told.value - 9e-4) < told.half
    assert told.half < 5e-5  # of gyros that draw 2e-5 each


@pytest.mark.parametrize("seed", [321])
@pytest.mark.further("seed", [322, 323, 324])
def test_gyros_that_scatter_by_themselves_are_no_table(seed: int) -> None:
    """Fifteen times what the spec has, on each of them; and on one alone."""
    hall = days(seed, 24)
    assert _told(read(hall, seed, gyro=Noise(4e-4, 1e-3, scale=SCATTER))) is None
    share = SCATTER * np.random.default_rng(seed).normal(size=24)[hall.run - 1]
    assert _told(hidden(read(hall, seed, gyro=DRAWN), "gyro", 1, share * hall.turn[:, 1])) is None


def test_what_the_spec_lets_gyros_draw_is_no_finding() -> None:
    shares = 3e-5 * np.random.default_rng(331).normal(size=24)
    assert _told(_table(331, shares)) is None


def test_a_table_that_is_wrong_above_a_rate_has_one_name() -> None:
    """Power-ons of other rates scatter together then: a second table rate of 0.003 stood beside it."""
    hall = days(341, 24)
    fast = np.linalg.norm(hall.turn, axis=1, keepdims=True) > 100.0
    slow = np.where((hall.run % 3 == 0)[:, None] & fast, hall.turn / 4.0, hall.turn)
    hall = replace(hall, turn=slow)
    felt = replace(
        hall, turn=hall.turn * np.where(np.linalg.norm(slow, axis=1, keepdims=True) > 100.0, 1.0005, 1.0)
    )
    found = diagnose(read(hall, 341, gyro=DRAWN, felt=felt), SPEC)
    assert [s.hypothesis for s in found.reference_suspects] == ["table_rate"]


def _elsewhere(seed: int, by: np.ndarray) -> DwellTable:
    """Power-ons in which gravity is larger by a share (g,) than the reference says."""
    hall = days(seed, 24)
    return read(hall, seed, felt=replace(hall, up=hall.up * (1.0 + by[hall.run - 1])[:, None]))


@pytest.mark.parametrize(("seed", "by"), [(342, -9e-4)])
@pytest.mark.further(("seed", "by"), [(341, 2.6e-3), (343, 5e-4), (344, -2e-3)])
def test_a_bench_of_another_gravity_from_some_day_on(seed: int, by: float) -> None:
    """A cubic of three accelerometers was said of it, or their spread was over its budget, and no more."""
    found = diagnose(_elsewhere(seed, np.where(np.arange(24) >= 13, by, 0.0)), SPEC)
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "local_gravity"
    assert "from run 14 on" in suspect.check
    assert suspect.low < abs(by) < suspect.high
    assert (found.effects, found.unknown) == ((), ())


@pytest.mark.parametrize("seed", [351])
@pytest.mark.further("seed", [352, 353, 354])
def test_accelerometers_that_scatter_by_themselves_are_no_gravity(seed: int) -> None:
    """The same step of one, and a scatter of its own in each of them."""
    hall, rng = days(seed, 24), np.random.default_rng([seed, 93])
    table = hidden(read(hall, seed), "acc", 1, 1e-3 * (hall.run > 13) * hall.up[:, 1])
    for axis in range(3):
        table = hidden(table, "acc", axis, 1e-4 * rng.normal(size=24)[hall.run - 1] * hall.up[:, axis])
    assert "local_gravity" not in {s.hypothesis for s in diagnose(table, SPEC).reference_suspects}


def _one_way_up(seed: int) -> Hall:
    """Three power-ons stand on each axis in turn, one way up, and turn; the others hold six faces."""
    rng, log = np.random.default_rng([seed, 73]), Log()
    for k in range(24):
        log.on(rng.uniform(5.0, 20.0))
        degc = (-20.0, 40.0)[k // 2 % 2] + 0.2 * rng.normal()
        for i in rng.permutation(6) if k % 8 else ():
            log.record(*FACES[i], degc)
        for axis in () if k % 8 else range(3):
            for turn in (-200.0, -80.0, 80.0, 200.0):
                log.record(axis, 1.0, degc, turn=turn)
                off_axis = 0.03 * (turn / 200.0) ** 2  # g
                log.rows[-1][5:8] = [*(np.eye(3)[axis] + off_axis * np.eye(3)[(axis + 1) % 3])]
        log.day += 0.2
    return log.hall()


@pytest.mark.parametrize("seed", [905])
@pytest.mark.further("seed", [901, 902, 903, 904])
def test_levels_of_power_ons_that_stand_one_way_up_are_no_gravity(seed: int) -> None:
    """Their inputs sum to 1 g but for what turning adds: by that alone gravity differed at 4e-8."""
    acc = Noise(1e-4, 1e-3, within=1e-4)
    data = prepared(replace(read(_one_way_up(seed), seed, acc=acc), gyro=None), SPEC.unit)
    found = [diagnose_sensor(data, "accelerometer", tuple(SPEC.effects), 1)]
    assert gravity_of_power_ons(found, data, []) is None


@pytest.mark.parametrize("seed", [331])
@pytest.mark.further("seed", [332, 333])
def test_accelerometers_that_scatter_together_are_a_gravity(seed: int) -> None:
    hall = days(seed, 24)
    by = SCATTER * np.random.default_rng(seed).normal(size=24)
    felt = replace(hall, up=hall.up * (1.0 + by[hall.run - 1])[:, None])
    data = prepared(replace(read(hall, seed, felt=felt), gyro=None), SPEC.unit)
    found = [diagnose_sensor(data, "accelerometer", tuple(SPEC.effects), 1)]
    told = gravity_of_power_ons(found, data, [])
    assert told is not None
    assert abs(told.value - SCATTER) < 0.5 * SCATTER
