"""Scale-factor error: a constant relative error of each channel, y_i = (1 + κ_i) u_i (K 2.1, eq. 9)."""

from __future__ import annotations

from collections.abc import Mapping

from planner.effects._channels import ChannelEffect, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class ScaleFactor(ChannelEffect):
    """κ_i, the relative error of the slope; 0.01 is one per cent."""

    name = "scale_factor"
    units: Mapping[Sensor, str] = {"gyro": "1", "accelerometer": "1"}
    group: Group = "scale_factor"
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "rate"
    linear_in_force = True
    title = "scale factor"
    equation = "y_i += κ_i u_i"
    source = "K 2.1, eq. 5"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """u_i, the rate or the specific force along the channel: (n, 3)."""
        return sensed(sensor, conditions)


EFFECT = ScaleFactor()
