"""Turns between two rests: gravity turns in the body by what the gyros turn by, df/dt = −ω × f."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from planner.nouns.array import Array
from planner.recordings.rests import Segment, mean_of, pause
from planner.recordings.windows import Windows

LONGEST_S = 60.0  # over which a bias of 0.1 deg/s turns 6°
Turn = tuple[Array, Array, Array]  # direction before, direction after, (m, 3) small turns in rad


def neighbours(windows: Windows, rests: Sequence[Segment]) -> Iterator[tuple[Segment, Segment, Array, Array]]:
    """Two rests and the (6,) mean of each, with windows but no gap and at most a minute between them."""
    if not np.isfinite(windows.mean).all():
        return
    for a, b in pairwise(rests):
        whole = windows.whole[a.last : b.first].all() and b.first > a.last
        if whole and pause(windows, a, b) <= LONGEST_S:
            yield a, b, mean_of(windows, a), mean_of(windows, b)


def carried(direction: Array, axis: Array, angle: Array | float) -> Array:
    """(c, 3) directions that stand still in space, seen in a body that turns by an angle about unit axes.

    The body turns by +angle, so a direction turns by −angle in it (Rodrigues).
    """
    along = axis * (axis * direction).sum(axis=1, keepdims=True)
    turned = along + (direction - along) * np.cos(angle) - np.cross(axis, direction) * np.sin(angle)
    return np.asarray(turned)


def apart(directions: Array, other: Array) -> Array:
    """(c,) angles between (c, 3) directions and another one."""
    return np.asarray(np.arccos(np.clip(directions @ other, -1, 1)))
