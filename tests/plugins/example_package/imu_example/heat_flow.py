"""Heat flow: a bias that follows dT/dt and saturates, y_i += k_i tanh(Ṫ / r)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects import ChannelEffect, Condition, Group, Parameter, Sensor
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions


class HeatFlow(ChannelEffect):
    """k_i, the bias under a steep ramp; r = `ramp`, the rate at which it bends."""

    name = "heat_flow"
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}
    group: Group = "bias"
    parameters = (Parameter("ramp", "K/min", 2.0 / 60.0, low=0.2 / 60.0, high=20.0 / 60.0),)
    needs = frozenset[Condition](("temperature_rate",))
    variable: Condition | None = "temperature_rate"
    title = "heat flow"
    equation = "y_i += k_i tanh(Ṫ / r)"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """(n,) tanh(Ṫ / r)."""
        return np.tanh(conditions.temperature_rate / nonlinear["ramp"])


EFFECT = HeatFlow()
