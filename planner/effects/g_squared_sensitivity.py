"""Gyro bias that grows with the square of specific force, y_i += k_i f_i² (IEEE Std 528: g²-sensitivity)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class GSquaredSensitivity(ChannelEffect):
    """k_i, with the specific force along the sensing axis."""

    name = "g_squared_sensitivity"
    sensors: tuple[Sensor, ...] = ("gyro",)
    units: Mapping[Sensor, str] = {"gyro": "deg/s/g**2"}
    group: Group = "bias"
    needs = frozenset[Condition](("specific_force",))
    variable: Condition | None = "specific_force"
    title = "g²-sensitivity"
    equation = "y_i += k_i f_i²"
    source = "IEEE Std 528"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """f_i²: (n, 3)."""
        return np.square(conditions.specific_force)


EFFECT = GSquaredSensitivity()
