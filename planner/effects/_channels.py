"""What most effects share: one coefficient per channel, driven by something of that channel."""

from __future__ import annotations

import numpy as np

from planner.protocols import Sensor, Term
from planner.records import Array, Conditions

AXES = ("x", "y", "z")
CHANNELS = tuple(Term(axis) for axis in AXES)


def sensed(sensor: Sensor, conditions: Conditions) -> Array:
    """(n, 3) what the sensor senses: rate for gyros, specific force for accelerometers."""
    return conditions.rate if sensor == "gyro" else conditions.specific_force


def per_channel(drive: Array) -> Array:
    """(n, 3) drive -> (n, 3, 3) regressors in which term i acts on channel i only."""
    return np.einsum("ni,ij->nij", drive, np.eye(3))
