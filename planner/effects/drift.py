"""Bias that drifts evenly while the unit is on, y_i += k_i t, from zero again at every power-on."""

from __future__ import annotations

from collections.abc import Mapping

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class Drift(ChannelEffect):
    """k_i, the bias per time since power-on (IEEE Std 952: rate ramp)."""

    name = "drift"
    units: Mapping[Sensor, str] = {"gyro": "deg/s/h", "accelerometer": "mg/h"}
    group: Group = "bias"
    needs = frozenset[Condition](("time_on",))
    variable: Condition | None = "time_on"
    title = "drift within a power-on"
    equation = "y_i += k_i t"
    source = "IEEE Std 952, rate ramp"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """Seconds since power-on: (n,)."""
        return conditions.time_on


EFFECT = Drift()
