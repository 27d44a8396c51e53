"""Scale factor over temperature, y_i += k_i (T − 20 °C) u_i (K 2.1, eq. 9 and 2.4: the linear part)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import REFERENCE_DEGC, ChannelEffect, Group, sensed
from planner.protocols import Sensor
from planner.records import Array, Conditions


class ScaleFactorTemperature(ChannelEffect):
    """k_i, the change of the relative scale-factor error per kelvin; zero at 20 °C."""

    name = "scale_factor_temperature"
    units: Mapping[Sensor, str] = {"gyro": "1/K", "accelerometer": "1/K"}
    group: Group = "scale_factor"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """(T − 20 °C) u_i: (n, 3)."""
        return (conditions.temperature_degc - REFERENCE_DEGC)[:, np.newaxis] * sensed(sensor, conditions)


EFFECT = ScaleFactorTemperature()
