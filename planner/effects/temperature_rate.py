"""Bias while the temperature changes (thermal hysteresis), y_i += k_i dT/dt (K 2.4, tables 2.11 and 2.12)."""

from __future__ import annotations

from collections.abc import Mapping

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class TemperatureRate(ChannelEffect):
    """k_i, the bias per rate of temperature. K finds it in the bias and none in the scale factor."""

    name = "temperature_rate"
    units: Mapping[Sensor, str] = {"gyro": "deg/s/(K/min)", "accelerometer": "g/(K/min)"}
    group: Group = "bias"
    needs = frozenset[Condition](("temperature_rate",))
    variable: Condition | None = "temperature_rate"
    title = "bias over the rate of temperature"
    equation = "y_i += k_i dT/dt"
    source = "K 2.4, tables 2.11 and 2.12"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """dT/dt in K/s: (n,)."""
        return conditions.temperature_rate


EFFECT = TemperatureRate()
