"""A curve that a table misses between its nodes is no lag and no rate of temperature; what ramps say is."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from planner.diagnose.vetoes.refusals import BENT
from planner.nouns.dwell_table import DwellTable
from planner.spec.model import Spec
from tests.diagnose.worlds import named
from tests.specs import shipped

G = 9.80665
MG = 1e-3 * G
SOAKS = (-53.0, -36.0, 11.0, 58.0)
FACES = np.kron(np.eye(3), [[1.0], [-1.0]])
ONE_WAY = ((-36.0, 2.1), (-38.0, -2.1), (15.5, 1.0), (8.0, -1.0))  # each through a gap, or part, of its own
BOTH_WAYS = ((-36.0, 2.0), (-26.0, -2.0), (12.0, 2.0), (22.0, -2.0), (30.0, 2.0), (40.0, -2.0))


def ramped(
    seed: int, ramps: tuple[tuple[float, float], ...], curve: float, rate: float = 0.0, visits: int = 6
) -> DwellTable:
    """Six faces in soaks at four temperatures, five on each ramp from a temperature at K/min. Plain NumPy.

    curve: mg of T₃ of every accelerometer over ±60 K, no rate in it
    rate: mg per K/min of x alone, beside it
    """
    rng = np.random.default_rng([seed, 77])
    runs = [(t, 0.0) for t in SOAKS for _ in range(visits)] + list(ramps)
    size = [6 if r == 0.0 else 5 for _, r in runs]
    run = np.repeat(np.arange(len(runs)), size)
    up = np.concatenate([FACES[rng.permutation(6)[:m]] for m in size])
    time_on = np.concatenate([40.0 + 110.0 * np.arange(m) for m in size])
    start, slope = np.array(runs)[run].T
    t = start + slope * (time_on - 40.0) / 60.0 + rng.normal(0.0, 0.05, len(run))
    x = (t - 5.0) / 60.0
    shapes = np.stack([x, 2 * x**2 - 1, 4 * x**3 - 3 * x], axis=1)
    sizes = rng.normal(size=(3, 3)) * [[5.0], [3.0], [0.0]]
    sizes[2] = curve * rng.choice([-1.0, 1.0], 3)
    bias = shapes @ sizes + rng.normal(0.0, 10.0, 3) + 0.4 * rng.normal(size=(len(runs), 3))[run]
    bias[:, 0] += rate * slope
    force = up * G
    acc = (force * (1.0 + rng.normal(0.0, 1e-3, 3))) @ (np.eye(3) + rng.normal(0.0, 1e-3, (3, 3))).T
    acc += MG * (bias + 0.03 * rng.normal(size=force.shape))
    return DwellTable(
        unit=np.full(len(run), "ramped"), run=run, day=0.1 * run, time_on=time_on,
        duration=np.full(len(run), 90.0), temperature_degc=t, temperature_rate=slope / 60.0,
        ref_rate=np.zeros_like(force), ref_acc=force, gyro=None, acc=acc, source=f"ramped {seed}",
    )  # fmt: skip


@cache
def spec(residual: bool = True) -> Spec:
    """small_uav, with or without what it says that a table leaves of the accelerometers' bias."""
    found = shipped("small_uav").spec
    budgets = found.unit.accelerometer
    bias = budgets["bias"].model_copy(update={} if residual else {"temperature_residual": None})
    unit = found.unit.model_copy(update={"accelerometer": {**budgets, "bias": bias}})
    return found.model_copy(update={"unit": unit})


def searched(table: DwellTable, residual: bool = True) -> SensorFound:
    s = spec(residual)
    return diagnose_sensor(prepared(table, s.unit), "accelerometer", tuple(s.effects), 1)


def bent(s: SensorFound) -> set[str]:
    return {s.found.pool.blocks[veto.block].name for veto in s.refused if veto.why == BENT}


@pytest.mark.parametrize(
    ("seed", "curve", "name"),
    [
        (28, 2.0, "thermal_lag"),
        (42, 4.0, "temperature_rate_table_over_time"),
        (54, 2.0, "thermometer_lag"),
    ],
)
@pytest.mark.further(
    ("seed", "curve", "name"),
    [
        (24, 4.0, "thermal_lag"),
        (44, 4.0, "temperature_rate_table_over_time"),
        (45, 2.0, "temperature_rate_table_over_time"),
        (45, 4.0, "temperature_rate_table_over_time"),
        (29, 4.0, "thermometer_lag"),
        (41, 4.0, "thermometer_lag"),
    ],
)
def test_a_curve_between_nodes_is_no_rate_and_no_lag(seed: int, curve: float, name: str) -> None:
    """Nothing but a cubic is in them. What a spec does not say that a table leaves stays a finding."""
    table = ramped(seed, ONE_WAY, curve)
    s = searched(table)
    assert named(s.found) == set()
    assert name in bent(s)
    assert {found for found, _ in named(searched(table, residual=False).found)} == {name}


@pytest.mark.parametrize("seed", [2])
@pytest.mark.further("seed", [3, 5, 7, 8, 10, 11, 12])
def test_a_rate_up_and_down_through_the_same_gap_is_named(seed: int) -> None:
    """One mg per K/min beside a curve of two mg, where the spec lets a table of four points leave five."""
    assert named(searched(ramped(seed, BOTH_WAYS, 2.0, rate=1.0)).found) == {("temperature_rate", "x")}


@pytest.mark.parametrize("seed", [61, 62])
@pytest.mark.further("seed", [63])
def test_a_thermometer_that_lags_up_and_down_is_suspected(seed: int) -> None:
    table = ramped(seed, BOTH_WAYS, 2.0)
    lags = replace(table, temperature_degc=table.temperature_degc - 150.0 * table.temperature_rate)
    assert named(searched(lags).found) == {("thermometer_lag", "xyz")}
