"""Directions of the bench in body axes, as far as the conditions of a record show them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.physics.attitude import unit
from planner.units import STANDARD_GRAVITY_MPS2

TURNING = np.radians(1.0)  # rad/s: above it a record is of a turn, far above the Earth's rate
LOADED_G = 0.2  # horizontal load in g above which the unit is on a centrifuge
MORE_G = 1.01  # all that acts there: a load of 0.2 g beside gravity is 1.0198 g


def turning(conditions: Conditions) -> NDArray[np.bool_]:
    """(n,) whether the unit turns, by the reference."""
    return np.asarray(np.linalg.norm(conditions.rate, axis=1) > TURNING)


def upwards(conditions: Conditions) -> Array:
    """(n, 3) unit vector that points up: along gravity's reaction, on a loaded turn along its axis."""
    f = conditions.specific_force
    up = unit(f)
    axis = unit(conditions.rate)
    axis = axis * np.where(np.sum(axis * f, axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    across = f - axis * np.sum(axis * f, axis=1, keepdims=True)
    return np.where((_on_an_arm(conditions) & _large(across))[:, np.newaxis], axis, up)


def load(conditions: Conditions) -> Array:
    """(n, 3) m/s² the centrifuge's load: the part of the specific force across the axis of a turn."""
    up = upwards(conditions)
    f = conditions.specific_force
    across = f - up * np.sum(up * f, axis=1, keepdims=True)
    return np.where((_on_an_arm(conditions) & _large(across))[:, np.newaxis], across, 0.0)


def _on_an_arm(conditions: Conditions) -> NDArray[np.bool_]:
    """(n,) whether an arm may bear the unit: it turns under more than gravity.

    A part of a turn about a level axis leaves a mean force across that axis too, of no more than gravity.
    """
    size = np.linalg.norm(conditions.specific_force, axis=1)
    return np.asarray(turning(conditions) & (size > MORE_G * STANDARD_GRAVITY_MPS2))


def _large(across: Array) -> NDArray[np.bool_]:
    return np.asarray(np.linalg.norm(across, axis=1) > LOADED_G * STANDARD_GRAVITY_MPS2)
