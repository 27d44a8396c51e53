"""Scale factor that changes under acceleration, y_i += k_i |f| ω_i, y_i += k_i |f_i| f_i (K 2.2.6, eq. 4).

K drives it with the set acceleration of the centrifuge, a magnitude, whichever face the unit is mounted on,
and fits k2 a² + k1 a + k0; this is the k1 part. The load of a centrifuge is across the axis of rotation, so
the bench cannot tell |f| from the part of f across the sensing axis; the modulus is K's own variable. A
component along a body axis would change sign when the unit is turned round; K table 2.5 has like values.
An accelerometer's is driven by what it senses itself; k2 is there `scale_factor_nonlinearity`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class ScaleFactorAcceleration(ChannelEffect):
    """k_i, the change of the relative scale-factor error per unit of |f|; 0.1 % at 50 g is 2e-5 / g."""

    name = "scale_factor_acceleration"
    units: Mapping[Sensor, str] = {"gyro": "1/g", "accelerometer": "1/g"}
    group: Group = "scale_factor"
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "specific_force"
    title = "scale factor over acceleration"
    equation = "y_i += k_i |f| ω_i; accelerometer: k_i |f_i| f_i"
    source = "K 2.2.6, eq. 4"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """|f| ω_i, or |f_i| f_i: (n, 3)."""
        if sensor == "accelerometer":
            return np.abs(conditions.specific_force) * conditions.specific_force
        modulus: Array = np.linalg.norm(conditions.specific_force, axis=1, keepdims=True)
        return modulus * conditions.rate


EFFECT = ScaleFactorAcceleration()
