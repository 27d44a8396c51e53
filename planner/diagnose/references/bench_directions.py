"""Where a record points on its bench, as far as its references say: loaded, at rest, north and east.

Up is along gravity's reaction, north along the horizontal part of the Earth's rate in `ref_rate`, or, where
it has none, along the next axis in cyclic order (planner.effects.earth_rate).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.effects._bench_frame import load, turning, upwards
from planner.measurement import as_sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, asked_once
from planner.units import STANDARD_GRAVITY_MPS2

HORIZONTAL = 1e-6  # rad/s: a fiftieth of the Earth's rate, below which a reference names no north
UNLOADED = 0.2  # of g, by which the force may differ from it at rest


@asked_once
def loaded(conditions: Conditions) -> NDArray[np.bool_]:
    """(n,) whether the unit is on a centrifuge."""
    return np.asarray(np.any(load(conditions) != 0.0, axis=1))


@asked_once
def at_rest(conditions: Conditions) -> NDArray[np.bool_]:
    """(n,) whether gravity alone acts and nothing turns."""
    size = np.linalg.norm(conditions.specific_force, axis=1) / STANDARD_GRAVITY_MPS2
    return np.asarray(~turning(conditions) & (np.abs(size - 1.0) < UNLOADED))


@asked_once
def horizontal(conditions: Conditions) -> tuple[Array, Array]:
    """(n, 3) unit vectors north and east in body axes; zero where nobody knows them."""
    up = upwards(conditions)
    rate = np.where(turning(conditions)[:, None], 0.0, conditions.rate)
    across = rate - up * np.sum(up * rate, axis=1, keepdims=True)
    size = np.linalg.norm(across, axis=1, keepdims=True)
    told = size > HORIZONTAL
    guess = np.roll(np.round(up), 1, axis=1) * (np.abs(up).max(axis=1, keepdims=True) > 0.98)
    north = np.where(told, across / np.where(told, size, 1.0), guess)
    return north, np.cross(north, up)


def through_the_unit(c: Channel, across: Sequence[Array]) -> Array:
    """(n, k) what changes (n, 3) of the true input add to the channel, through its leans and scale factor.

    0.25 deg of a lean are 0.4 % of what is put right: of a mounting that is 0.1 deg off and turns by
    180 deg/s eight sigma of each row.
    """
    return as_sensed(c.model, c.theta, np.stack(across, axis=2)) * c.lean[:, None]
