"""Cold knee: below a temperature the bias runs off, y_i += k_i max(T0 − T, 0)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects import ChannelEffect, Condition, Group, Parameter, Sensor
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions


class ColdKnee(ChannelEffect):
    """k_i, the bias per kelvin below the knee; T0 = `knee_degc`."""

    name = "cold_knee"
    units: Mapping[Sensor, str] = {"gyro": "deg/s/K", "accelerometer": "g/K"}
    group: Group = "bias"
    parameters = (Parameter("knee_degc", "degC", -10.0, low=-60.0, high=40.0, scale="linear"),)
    needs = frozenset[Condition](("temperature_degc",))
    variable: Condition | None = "temperature_degc"
    title = "cold knee"
    equation = "y_i += k_i max(T0 − T, 0)"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """(n,) kelvins below the knee, 0 above."""
        return np.maximum(nonlinear["knee_degc"] - conditions.temperature_degc, 0.0)


EFFECT = ColdKnee()
