"""Bias over temperature, y_i += k_i (T − 20 °C) (K 2.1, eq. 6 and 2.4: the linear part)."""

from __future__ import annotations

from collections.abc import Mapping

from planner.effects._channels import REFERENCE_DEGC, ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class BiasTemperature(ChannelEffect):
    """k_i, the change of the bias per kelvin; zero at 20 °C."""

    name = "bias_temperature"
    units: Mapping[Sensor, str] = {"gyro": "deg/s/K", "accelerometer": "g/K"}
    group: Group = "bias"
    needs = frozenset[Condition](("temperature_degc",))
    variable: Condition | None = "temperature_degc"
    temperature_of = "bias"
    tabled = True
    title = "bias over temperature"
    equation = "y_i += k_i (T − 20 °C)"
    source = "K 2.1, eq. 6 and 2.4"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """T − 20 °C: (n,)."""
        return conditions.temperature_degc - REFERENCE_DEGC


EFFECT = BiasTemperature()
