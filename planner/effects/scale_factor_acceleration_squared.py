"""Gyro scale factor over acceleration squared, y_i += k_i |f|² ω_i (K 2.2.6: k2 of k2 a² + k1 a + k0).

k0 is the scale factor, k1 `scale_factor_acceleration`. For accelerometers the square of their own input is
the cubic of `scale_factor_nonlinearity`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class ScaleFactorAccelerationSquared(ChannelEffect):
    """k_i, the change of the relative scale-factor error per |f|²; K's figure 2.6 has 0.4 % at 100 g."""

    name = "scale_factor_acceleration_squared"
    sensors: tuple[Sensor, ...] = ("gyro",)
    units: Mapping[Sensor, str] = {"gyro": "1/g**2"}
    group: Group = "scale_factor"
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "specific_force"
    title = "scale factor over acceleration squared"
    equation = "y_i += k_i |f|² ω_i"
    source = "K 2.2.6: K(a) = k2 a² + k1 a + k0"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """|f|² ω_i: (n, 3)."""
        square = np.sum(np.square(conditions.specific_force), axis=1, keepdims=True)
        return np.asarray(square * conditions.rate)


EFFECT = ScaleFactorAccelerationSquared()
