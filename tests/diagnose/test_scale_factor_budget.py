"""A scale factor's spread is held against its budget less what the budgets let wander within a power-on."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from planner.diagnose.hypotheses.assumptions import assumptions, exceeded
from planner.diagnose.hypotheses.prepared import prepared
from planner.diagnose.hypotheses.sensor import diagnose_sensor
from planner.nouns.diagnosis import Assumption
from planner.nouns.sensor import Sensor
from planner.pipelines.data import simulate
from planner.simulate.settings import settings_of
from planner.spec.load import LoadedSpec, load_spec
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


@pytest.mark.parametrize(
    ("seed", "sensor"), [(3, "gyro"), (4, "gyro"), (4, "accelerometer"), (5, "gyro"), (6, "gyro")]
)
def test_a_unit_within_its_budgets_exceeds_none(seed: int, sensor: Sensor) -> None:
    """In-run of .002 % had been counted as run-to-run, and .5 mg of wander on six faces as .02 % of 1 g."""
    found = judged(loaded(), seed, sensor)
    assert exceeded(found) == ()
    told = [a for a in found if a.error.endswith("scale_factor") and a.measured == a.measured]
    assert told
    assert all(a.low <= (a.assumed or 0.0) <= a.high for a in told)


@pytest.mark.parametrize("seed", [3, 5])
def test_a_spread_far_above_its_budget_is_said_with_its_size(seed: int) -> None:
    unit = of(loaded(), "gyro", run_to_run=Quantity(2e-4, "[]", "0.02 %"))
    (said,) = exceeded(judged(unit, seed, "gyro"))
    assert said.error == "gyro.scale_factor"
    assert said.low <= 2e-4 <= said.high
