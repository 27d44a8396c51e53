"""Scale-factor nonlinearity: cubic, y_i += c_i u_i (u_i / U)² (K 2.2.5, table 2.4; IEEE Std 528).

The odd part that a straight line leaves first. An even part is `scale_factor_asymmetry`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import ChannelEffect, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor
from planner.units import STANDARD_GRAVITY_MPS2

# ends of the table in K 2.2.5 (gyro) and the load at which high-g units are rated (accelerometer)
REFERENCE_INPUT: Mapping[Sensor, float] = {
    "gyro": float(np.radians(500.0)),
    "accelerometer": 50.0 * STANDARD_GRAVITY_MPS2,
}


class ScaleFactorNonlinearity(ChannelEffect):
    """c_i, the change of the relative scale-factor error from zero to U: 500 deg/s or 50 g."""

    name = "scale_factor_nonlinearity"
    units: Mapping[Sensor, str] = {"gyro": "1", "accelerometer": "1"}
    group: Group = "scale_factor"
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "rate"
    title = "scale-factor nonlinearity"
    equation = "y_i += c_i u_i (u_i / U)²"
    source = "K 2.2.5, table 2.4; IEEE Std 528"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """u_i (u_i / U)²: (n, 3)."""
        u = sensed(sensor, conditions)
        return u * np.square(u / REFERENCE_INPUT[sensor])


EFFECT = ScaleFactorNonlinearity()
