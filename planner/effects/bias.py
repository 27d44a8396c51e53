"""Bias: a constant on each channel, y_i = u_i + b_i (K 2.1, eq. 5)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Group, Sensor


class Bias(ChannelEffect):
    """b_i, the output at zero input; the mean over many power-ons is what calibration can remove."""

    name = "bias"
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}
    group: Group = "bias"
    title = "bias"
    equation = "y_i += b_i"
    source = "K 2.1, eq. 5"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """One at every instant: (n,)."""
        return np.ones(len(conditions.rate))


EFFECT = Bias()
