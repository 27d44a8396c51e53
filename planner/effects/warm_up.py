"""Warm-up: a bias that dies out after power-on, y_i += k_i exp(−t / τ) (K 2.1: drift after initial bias)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Parameter, Sensor


class WarmUp(ChannelEffect):
    """k_i, the extra bias at the moment of power-on; τ = `time_constant` in seconds."""

    name = "warm_up"
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}
    group: Group = "bias"
    parameters = (Parameter("time_constant", "s", 600.0, low=30, high=12000.0),)
    needs = frozenset[Condition](("time_on",))
    variable: Condition | None = "time_on"
    title = "warm-up"
    equation = "y_i += k_i exp(−t / τ)"
    source = "K 2.1"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """exp(−t / τ), t since power-on: (n,)."""
        return np.exp(-conditions.time_on / nonlinear["time_constant"])


EFFECT = WarmUp()
