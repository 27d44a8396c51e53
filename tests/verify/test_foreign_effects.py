"""Effects that nothing in the program knows by name are counted, calibrated and flown like ours."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from planner import catalog
from planner.effects._channels import CHANNELS, BaseEffect, ChannelEffect
from planner.pipelines.promise import FlightOptions, verify
from planner.protocols import Parameter
from planner.verify.experiment import units_left
from planner.verify.structure import affine
from tests.verify.plans import flown, planned_from

UNITS = {"gyro": "deg/s", "accelerometer": "g"}
PER_KELVIN = {"gyro": "deg/s/K", "accelerometer": "g/K"}


class SelfHeating(ChannelEffect):
    """A bias that grows after power-on, k (1 − exp(−t/τ))."""

    name, units, group = "self_heating", UNITS, "bias"
    parameters = (Parameter("time_constant", "s", 900.0, low=30.0, high=9000.0),)
    needs = frozenset({"time_on"})
    title, equation = "self-heating", "y += k (1 − exp(−t/τ))"

    def drive(self, sensor, conditions, nonlinear):
        return 1.0 - np.exp(-conditions.time_on / nonlinear["time_constant"])


class Knee(ChannelEffect):
    """A bias below a temperature, k max(T₀ − T, 0); carried by the bias's table."""

    name, units, group = "knee", PER_KELVIN, "bias"
    parameters = (Parameter("knee_degc", "degC", -10.0, low=-60.0, high=60.0, scale="linear"),)
    needs = frozenset({"temperature_degc"})
    temperature_of, tabled = "bias", True
    title, equation = "knee", "y += k max(T₀ − T, 0)"

    def drive(self, sensor, conditions, nonlinear):
        return np.maximum(nonlinear["knee_degc"] - conditions.temperature_degc, 0.0)


class Offset(ChannelEffect):
    """Another bias under another name: constant, so that it is corrected exactly."""

    name, units, group = "offset", UNITS, "bias"
    title, equation = "offset", "y += k"

    def drive(self, sensor, conditions, nonlinear):
        return np.ones(len(conditions.day))


class Crosstalk(BaseEffect):
    """All channels read a little of the sum of the inputs."""

    name, units, group = "crosstalk", {"gyro": "1", "accelerometer": "1"}, "misalignment"
    needs = frozenset({"rate", "specific_force"})
    title, equation = "crosstalk", "y_i += k_i Σ u_j"

    def terms(self, sensor):
        return CHANNELS

    def regressors(self, sensor, conditions, nonlinear=None):
        u = conditions.rate if sensor == "gyro" else conditions.specific_force
        return u.sum(axis=1)[:, None, None] * np.eye(3)


@pytest.fixture(name="known")
def _known(monkeypatch):
    every = dict(catalog.effects()) | {e.name: e for e in (SelfHeating(), Knee(), Offset(), Crosstalk())}
    ours = catalog.plugins

    def plugins(package, constant, **how):
        return every if package == "planner.effects" else ours(package, constant, **how)

    monkeypatch.setattr(catalog, "plugins", plugins)
    affine.cache_clear()
    yield every
    affine.cache_clear()


def with_effect(name, budget):
    spec = copy.deepcopy(flown())
    spec["name"] = name
    spec["unit"]["gyro"][name] = budget
    spec["effects"] = [*spec["effects"], name]
    spec["requirement"][0]["limit"] = "9000 m"
    return spec


@pytest.mark.parametrize(
    ("name", "unit"), [("self_heating", "deg/s"), ("knee", "deg/s/K"), ("crosstalk", "")]
)
def test_a_plan_with_an_effect_of_ones_own_has_no_fault(known, name, unit):
    size = "0.1 %" if not unit else f"0.001 {unit}"
    spec = with_effect(name, {"systematic": size, "run_to_run": size.replace("1", "01")})
    one = planned_from(spec)
    found = verify(one.loaded, one.document, FlightOptions(flights=50, through_files=0), lambda message: None)
    assert found.recount.ok, found.recount.faults[:3]
    assert found.outcomes


def test_what_a_table_carries_flies_with_the_effect_that_it_changes(known):
    spec = with_effect("knee", {"systematic": "0.001 deg/s/K"})
    one = planned_from(spec)
    from planner.verify.experiment import experiment

    e = experiment(one.document, one.loaded.spec, one.trajectory, seed=2, where="range")
    names = [x.name for x in units_left(e, 0, 5)]
    assert "gyro.bias" in names
    assert "gyro.knee" not in names


def test_constants_and_slopes_are_told_by_the_effects_themselves(known):
    assert np.array_equal(affine("gyro", "offset").constant, np.eye(3))
    assert np.array_equal(affine("gyro", "scale_factor").slope, affine_of_scale())
    assert affine("gyro", "crosstalk").slope.shape == (3, 3, 3)
    for name in ("self_heating", "g_sensitivity", "scale_factor_asymmetry", "warm_up"):
        assert affine("gyro", name) is None


def affine_of_scale():
    slope = np.zeros((3, 3, 3))
    slope[range(3), range(3), range(3)] = 1.0
    return slope
