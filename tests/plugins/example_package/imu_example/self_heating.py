"""Self-heating: the bias grows as the unit warms itself after power-on, y_i += k_i (1 − exp(−t / τ))."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects import ChannelEffect, Condition, Group, Parameter, Sensor
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions


class SelfHeating(ChannelEffect):
    """k_i, the bias that is reached in the end; τ = `time_constant` in seconds."""

    name = "self_heating"
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}
    group: Group = "bias"
    parameters = (Parameter("time_constant", "s", 900.0, low=60.0, high=7200.0),)
    needs = frozenset[Condition](("time_on",))
    variable: Condition | None = "time_on"
    title = "self-heating"
    equation = "y_i += k_i (1 − exp(−t / τ))"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """(n,) 1 − exp(−t / τ)."""
        return 1.0 - np.exp(-conditions.time_on / nonlinear["time_constant"])


EFFECT = SelfHeating()
