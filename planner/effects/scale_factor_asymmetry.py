"""Scale-factor asymmetry: + and − input differ in slope, y_i += a_i |u_i| / 2 (IEEE Std 528; K 2.2.4)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import ChannelEffect, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class ScaleFactorAsymmetry(ChannelEffect):
    """a_i = (slope for + input) − (slope for − input); half of it goes to either side of their mean."""

    name = "scale_factor_asymmetry"
    units: Mapping[Sensor, str] = {"gyro": "1", "accelerometer": "1"}
    group: Group = "scale_factor"
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "rate"
    title = "scale-factor asymmetry"
    equation = "y_i += a_i |u_i| / 2"
    source = "IEEE Std 528; K 2.2.4"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """|u_i| / 2: (n, 3)."""
        return 0.5 * np.abs(sensed(sensor, conditions))


EFFECT = ScaleFactorAsymmetry()
