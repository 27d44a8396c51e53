"""Warm-up: a bias that dies out after power-on, y_i += k_i exp(−t / τ) (K 2.1: drift after initial bias)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import ChannelEffect, Group
from planner.protocols import Sensor
from planner.records import Array, Conditions


class WarmUp(ChannelEffect):
    """k_i, the extra bias at the moment of power-on; τ = `time_constant` in seconds."""

    name = "warm_up"
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}
    group: Group = "bias"
    nonlinear: Mapping[str, float] = {"time_constant": 600.0}

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """exp(−t / τ), t since power-on: (n,)."""
        return np.exp(-conditions.time_on / nonlinear["time_constant"])


EFFECT = WarmUp()
