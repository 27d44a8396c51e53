"""Scale factor over temperature, y_i += k_i (T − 20 °C) u_i (K 2.1, eq. 9 and 2.4: the linear part)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import REFERENCE_DEGC, ChannelEffect, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class ScaleFactorTemperature(ChannelEffect):
    """k_i, the change of the relative scale-factor error per kelvin; zero at 20 °C."""

    name = "scale_factor_temperature"
    units: Mapping[Sensor, str] = {"gyro": "1/K", "accelerometer": "1/K"}
    group: Group = "scale_factor"
    needs = frozenset[Condition](("rate", "specific_force", "temperature_degc"))
    variable: Condition | None = "temperature_degc"
    linear_in_force = True
    temperature_of = "scale_factor"
    tabled = True
    title = "scale factor over temperature"
    equation = "y_i += k_i (T − 20 °C) u_i"
    source = "K 2.1, eq. 6 and 2.4"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """(T − 20 °C) u_i: (n, 3)."""
        return (conditions.temperature_degc - REFERENCE_DEGC)[:, np.newaxis] * sensed(sensor, conditions)


EFFECT = ScaleFactorTemperature()
