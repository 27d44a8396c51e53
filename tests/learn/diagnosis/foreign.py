"""Effects of other people's packages, of one parameter, a linear one and two, and a unit that has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from planner import catalog
from planner.effects import ChannelEffect, Condition, Group, Parameter, Sensor
from planner.measured import DwellTable
from planner.protocols import Effect
from planner.records import Array, Conditions
from tests.learn.world import Layout, campaign


class _Bias(ChannelEffect):
    units: Mapping[Sensor, str] = MappingProxyType({"gyro": "deg/s", "accelerometer": "g"})
    group: Group = "bias"


class SelfHeating(_Bias):
    """1 − exp(−t/τ)."""

    name = "self_heating"
    parameters = (Parameter("time_constant", "s", 900.0, low=30.0, high=20000.0),)
    needs = frozenset[Condition](("time_on",))
    variable: Condition | None = "time_on"
    title = "self-heating"
    equation = "y_i += k_i (1 − exp(−t / τ))"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        return 1.0 - np.exp(-conditions.time_on / nonlinear["time_constant"])


class ColdKnee(_Bias):
    """max(T0 − T, 0)."""

    name = "cold_knee"
    units: Mapping[Sensor, str] = MappingProxyType({"gyro": "deg/s/K", "accelerometer": "g/K"})
    parameters = (Parameter("knee_degc", "degC", -10.0, low=-60.0, high=40.0, scale="linear"),)
    needs = frozenset[Condition](("temperature_degc",))
    variable: Condition | None = "temperature_degc"
    title = "bias below a knee"
    equation = "y_i += k_i max(T0 − T, 0)"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        return np.maximum(nonlinear["knee_degc"] - conditions.temperature_degc, 0.0)


class Ripple(_Bias):
    """sin(2π t/P + φ)."""

    name = "ripple"
    parameters = (
        Parameter("period", "s", 400.0, low=150.0, high=1500.0),
        Parameter("phase", "rad", 0.0, low=-2.0, high=2.0, scale="linear"),
    )
    needs = frozenset[Condition](("time_on",))
    variable: Condition | None = "time_on"
    title = "ripple after power-on"
    equation = "y_i += k_i sin(2π t / P + φ)"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        return np.sin(2.0 * np.pi * conditions.time_on / nonlinear["period"] + nonlinear["phase"])


FOREIGN: Mapping[str, Effect] = {e.name: e for e in (SelfHeating(), ColdKnee(), Ripple())}
DECLARED = ("bias", "scale_factor", "misalignment")
LAYOUT = Layout(later=(30.0,), rate_repeats=1, centrifuge=False)

# what hides, from plain NumPy: (temperature, time since power-on, parameters) -> shape
SHAPES = {
    "self_heating": lambda T, t, p: 1.0 - np.exp(-t / p["time_constant"]),
    "cold_knee": lambda T, t, p: np.where(p["knee_degc"] > T, p["knee_degc"] - T, 0.0),
    "ripple": lambda T, t, p: np.sin(2.0 * np.pi * t / p["period"] + p["phase"]),
}


def with_foreign() -> Mapping[str, Effect]:
    """What the catalog finds when the package is installed."""
    return dict(sorted({**catalog.effects(), **FOREIGN}.items()))


def plain_unit(
    seed: int,
    effect: str = "",
    size: float = 0.0,
    parameters: Mapping[str, float] | None = None,
    axis: int = 0,
) -> DwellTable:
    """A bench campaign of gyros without curves over temperature, and what hides on one channel; SI."""
    table = campaign(seed, (), LAYOUT)
    assert table.ref_rate is not None
    rng = np.random.default_rng([seed, 5])
    n, g = len(table), int(table.run.max()) + 1
    white = np.radians(1.1e-3) * np.sqrt(60.0 / table.duration)[:, None] * rng.normal(size=(n, 3))
    run = np.radians(2e-3) * rng.normal(size=(g, 3))[table.run]
    gyro = table.ref_rate * (1.0 + 1e-3) + np.radians(0.02) + run + white
    if effect:
        gyro[:, axis] += size * SHAPES[effect](table.temperature_degc, table.time_on, parameters)
    return replace(table, gyro=gyro, acc=None)
