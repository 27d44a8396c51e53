"""Vibration rectification, and what else follows the force's square in any direction: y_i += k_i |f|²."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class VibrationRectification(ChannelEffect):
    """k_i, with the square of the whole specific force: a mean reading in answer to an alternating one."""

    name = "vibration_rectification"
    units: Mapping[Sensor, str] = {"gyro": "deg/s/g**2", "accelerometer": "mg/g**2"}
    group: Group = "bias"
    needs = frozenset[Condition](("specific_force",))
    variable: Condition | None = "specific_force"
    title = "vibration rectification"
    equation = "y_i += k_i |f|²"
    source = "IEEE Std 1293, vibration rectification coefficient"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """|f|²: (n,)."""
        return np.asarray(np.sum(np.square(conditions.specific_force), axis=1))


EFFECT = VibrationRectification()
