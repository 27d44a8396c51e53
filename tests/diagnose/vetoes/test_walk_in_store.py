"""A walk in store, as large as the spec budgets, is no step and no ageing; what stands beside it is."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from planner.diagnose.vetoes.refusals import WALKED
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.worlds import named
from tests.specs import shipped

SPEC = shipped("small_uav").spec
G = 9.80665
MG = 1e-3 * G
STORAGE = 1.0 * MG  # in 60 days, as small_uav's spec has it
LEVEL, WHITE = 0.4 * MG, 0.02 * MG
DAYS = np.repeat([0.0, 3.0, 6.0, 10.0, 14.0, 17.0, 21.0, 25.0, 28.0], 3)
TEMPERATURES = (-40.0, 20.0, 60.0)


def stored(seed: int, walk: float = 1.0, steps: float = 0.0, ages: float = 0.0) -> DwellTable:
    """Six faces at three temperatures on each of nine days, no input beside gravity. Plain NumPy.

    walk: of every accelerometer's bias, in budgets of the spec
    steps: mg by which x is another from day 14 on; ages: mg by which it changes a day
    """
    rng = np.random.default_rng([seed, 1515])
    run = np.repeat(np.arange(len(DAYS)), 6)
    day = DAYS[run] + 0.04 * (run % 3)
    t = np.array(TEMPERATURES)[run % 3] + rng.normal(0.0, 0.05, len(run))
    force = np.tile(np.kron(np.eye(3), [[1.0], [-1.0]]), (len(DAYS), 1)) * G
    since = np.sqrt(np.diff(np.unique(DAYS)) / 60.0)[:, None]
    walked = np.vstack([np.zeros(3), np.cumsum(since * rng.normal(size=(len(since), 3)), axis=0)])
    bias = walk * STORAGE * walked[run // 3] + LEVEL * rng.normal(size=(len(DAYS), 3))[run]
    bias += np.stack([np.ones(len(t)), t / 60.0, (t / 60.0) ** 2], axis=1) @ rng.normal(0.0, 5.0 * MG, (3, 3))
    bias[:, 0] += MG * (steps * (day >= 13.5) + ages * day)
    acc = (force * (1.0 + rng.normal(0.0, 1e-3, 3))) @ (np.eye(3) + rng.normal(0.0, 1e-3, (3, 3))).T + bias
    return _table(run, day, t, force, acc + WHITE * rng.normal(size=force.shape), seed)


def _table(run: Array, day: Array, t: Array, force: Array, acc: Array, seed: int) -> DwellTable:
    time_on = 60.0 + 80.0 * np.tile(np.arange(6.0), len(DAYS))
    return DwellTable(
        unit=np.full(len(run), "stored"), run=run, day=day, time_on=time_on, duration=np.full(len(run), 60.0),
        temperature_degc=t, temperature_rate=np.zeros(len(run)), ref_rate=np.zeros_like(force),
        ref_acc=force, gyro=None, acc=acc, source=f"stored {seed}",
    )  # fmt: skip


def _searched(table: DwellTable) -> SensorFound:
    return diagnose_sensor(prepared(table, SPEC.unit), "accelerometer", tuple(SPEC.effects), 1)


def _refused(s: SensorFound) -> set[str]:
    return {s.found.pool.blocks[veto.block].name for veto in s.refused if veto.why == WALKED}


@pytest.mark.parametrize(("seed", "name"), [(0, "bias_step"), (4, "ageing"), (29, "day")])
@pytest.mark.further(("seed", "name"), [(1, "bias_step"), (5, "bias_step"), (7, "ageing"), (13, "bias_step")])
def test_a_walk_that_the_spec_budgets_is_no_step_and_no_ageing(seed: int, name: str) -> None:
    """Of 30 such campaigns 21 channels of 90 were named, or unnamed over the days, at 4 to 9 sigma."""
    s = _searched(stored(seed))
    assert (named(s.found), s.found.unknown) == (set(), [])
    assert name in _refused(s)


@pytest.mark.parametrize("seed", [101, 102])
@pytest.mark.further("seed", [103, 104])
@pytest.mark.parametrize(("walk", "mg"), [(0.0, 2.5), (1.0, 4.0)])
def test_a_step_beyond_a_walk_is_named(seed: int, walk: float, mg: float) -> None:
    """Where nothing walks the other days and channels say so, and where they do it is larger than that."""
    assert named(_searched(stored(seed, walk, steps=mg)).found) == {("bias_step", "x")}


@pytest.mark.parametrize("seed", [101])
@pytest.mark.further("seed", [102, 103, 104])
@pytest.mark.parametrize(("walk", "mg"), [(0.0, 0.1), (1.0, 0.3)])
def test_an_ageing_beyond_a_walk_is_named(seed: int, walk: float, mg: float) -> None:
    assert named(_searched(stored(seed, walk, ages=mg)).found) == {("ageing", "x")}


def test_without_a_budget_of_storage_nothing_walks() -> None:
    """What a spec does not say a unit may do stays a finding."""
    budgets = SPEC.unit.accelerometer
    bias = budgets["bias"].model_copy(update={"storage": None})
    unit = SPEC.unit.model_copy(update={"accelerometer": {**budgets, "bias": bias}})
    s = diagnose_sensor(prepared(stored(4), unit), "accelerometer", tuple(SPEC.effects), 1)
    assert named(s.found) == {("ageing", "x")}
