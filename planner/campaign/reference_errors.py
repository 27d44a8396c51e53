"""What a bench whose references err adds to its records, to first order, where their motions are known.

A tilt of the base goes with gravity and the Earth's rate through the table's axes, the error of the driven
rate with the rate and, on an arm, twice with the load (`planner.campaign.exposure.Misplaced`). A dwell table
does not say how the bench's axes stood; the steps of a plan do.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from planner.campaign.exposure import Asked, Exposure, Misplaced
from planner.nouns.array import Array
from planner.spec.model import Spec

WAYS = ("level north", "level west", "rate")  # bench x points north, y west
_STEP = 1e-5  # rad, or of the rate: what is of second order is 1e-5 of the slope


def reference_errors(asked: Sequence[Asked], benches: Sequence[str], spec: Spec) -> Array:
    """(n, 3, 2, 3) slopes of every record's mean rate and specific force, SI, per radian of WAYS or per one.

    Zero on benches of which the spec says nothing.
    """
    found = np.zeros((len(asked), len(WAYS), 2, 3))
    for i, (record, bench) in enumerate(zip(asked, benches, strict=True)):
        accuracy = spec.benches[bench].accuracy
        if accuracy is not None and (accuracy.level > 0.0 or accuracy.rate > 0.0):
            motion = tuple(sorted(record.motion.items()))
            found[i] = _slopes(motion, record.duration, record.latitude, record.arm, record.mount)
    return found


@cache
def _slopes(
    motion: tuple[tuple[str, float], ...], duration: float, latitude: float, arm: float | None, mount: int
) -> Array:
    """(3, 2, 3); the records of a campaign repeat few motions."""
    asked = Asked(dict(motion), duration, latitude, arm, mount)
    return np.array(
        [
            (_means(asked.exposed(_off(way, _STEP))) - _means(asked.exposed(_off(way, -_STEP))))
            / (2.0 * _STEP)
            for way in np.eye(3)
        ]
    )


def _off(way: Array, size: float) -> Misplaced:
    return Misplaced(way[:2] * size, np.zeros(3), float(way[2] * size))


def _means(e: Exposure) -> Array:
    """(2, 3) rate and specific force."""
    return np.array([e.rate, e.specific_force])
