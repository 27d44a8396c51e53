"""Bias: a constant on each channel, y_i = u_i + b_i (K 2.1, eq. 5)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import CHANNELS
from planner.protocols import Sensor, Term
from planner.records import Array, Conditions


class Bias:
    """b_i, the output at zero input; the mean over many power-ons is what calibration can remove."""

    name = "bias"
    sensors: tuple[Sensor, ...] = ("gyro", "accelerometer")
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}
    group = "bias"
    nonlinear: Mapping[str, float] = {}

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """One per channel: x, y, z."""
        return CHANNELS

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """The identity at every instant: (n, 3, 3)."""
        return np.broadcast_to(np.eye(3), (len(conditions.rate), 3, 3)).copy()


EFFECT = Bias()
