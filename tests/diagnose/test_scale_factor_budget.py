"""A scale factor's spread is held against its budget less what the budgets let wander within a power-on."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.findings.assumptions import assumptions, exceeded
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.diagnosed_spreads import Assumption
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import Sensor
from planner.pipelines.data import simulate
from planner.simulate.settings import settings_of
from planner.spec.load import LoadedSpec, load_spec
from planner.units import STANDARD_GRAVITY_MPS2 as G
from planner.units import Quantity
from tests.specs import SHIPPED


@cache
def loaded() -> LoadedSpec:
    return load_spec(SHIPPED / "small_uav.yaml")


def judged(unit: LoadedSpec, seed: int, sensor: Sensor) -> list[Assumption]:
    """What a plain campaign of a unit says of the spreads that small_uav.yaml states."""
    table, _ = simulate(unit, None, (), seed, settings_of(unit.spec))
    data, spec = prepared(table), loaded().spec
    return assumptions(diagnose_sensor(data, sensor, tuple(spec.effects), 1), spec, data)


def of(unit: LoadedSpec, sensor: Sensor, **parts: object) -> LoadedSpec:
    """The unit with other parts of a sensor's scale factor."""
    budgets = getattr(unit.spec.unit, sensor)
    entries = budgets | {"scale_factor": budgets["scale_factor"].model_copy(update=parts)}
    made = unit.spec.unit.model_copy(update={sensor: entries})
    return replace(unit, spec=unit.spec.model_copy(update={"unit": made}))


@pytest.mark.parametrize(("seed", "sensor"), [(3, "gyro"), (4, "accelerometer")])
@pytest.mark.further(("seed", "sensor"), [(4, "gyro"), (5, "gyro"), (6, "gyro")])
def test_a_unit_within_its_budgets_exceeds_none(seed: int, sensor: Sensor) -> None:
    """In-run of .002 % had been counted as run-to-run, and .5 mg of wander on six faces as .02 % of 1 g.

    Six faces that wander by .5 mg do not tell .002 % of 1 g: what wanders has its budget, that is all.
    """
    found = judged(loaded(), seed, sensor)
    assert exceeded(found) == ()
    error = {"gyro": "gyro.scale_factor", "accelerometer": "accelerometer.bias"}[sensor]
    told = [a for a in found if a.error.endswith("scale_factor") or a.part == "in_run"]
    told = [a for a in told if a.measured == a.measured]
    assert error in {a.error for a in told}
    assert all(a.low <= (a.assumed or 0.0) <= a.high for a in told)


@pytest.mark.parametrize("seed", [3, 5])
def test_a_spread_far_above_its_budget_is_said_with_its_size(seed: int) -> None:
    unit = of(loaded(), "gyro", run_to_run=Quantity(2e-4, "[]", "0.02 %"))
    (said,) = exceeded(judged(unit, seed, "gyro"))
    assert said.error == "gyro.scale_factor"
    assert said.low <= 2e-4 <= said.high


@pytest.mark.parametrize("seed", range(3))
def test_power_ons_of_one_face_each_say_nothing_of_the_scale_factor(seed: int) -> None:
    """Its change and the bias' are one value a power-on; the spread was "known" to rounding, and exceeded."""
    rng = np.random.default_rng(seed)
    faces = np.repeat(np.tile(np.vstack([np.eye(3), -np.eye(3)]), (3, 1)), 12, axis=0)
    n = len(faces)
    table = DwellTable(
        unit=np.full(n, "u1"),
        run=np.arange(n) // 12,
        day=np.zeros(n),
        time_on=np.asarray(60.0 * (1.0 + np.arange(n) % 12)),
        duration=np.full(n, 20.0),
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        ref_rate=0.0 * faces,
        ref_acc=faces * G,
        gyro=None,
        acc=(1.001 * faces + 2e-3 + 3e-5 * rng.normal(size=(n, 3))) * G,
    )
    data, spec = prepared(table), loaded().spec
    found = assumptions(diagnose_sensor(data, "accelerometer", tuple(spec.effects), 1), spec, data)
    assert not [a for a in found if a.error.endswith("scale_factor") and np.isfinite(a.measured)]
    assert not exceeded(found)
