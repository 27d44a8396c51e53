"""The published recalibration in store (K 2.7, table 2.19) as a check of ours: the same unit, one repeat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.fleet.store import sensor_left
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.spec.recalibration import Recalibration
from planner.units import unit_factor


@dataclass(frozen=True)
class PublishedReduction:
    """One row of K table 2.19, SI: residual before and after, one sigma; run-to-run of that unit."""

    error: str
    unit: str
    before: float
    after: float
    run_to_run: float


def _row(error: str, unit: str, before: float, after: float, run_to_run: float) -> PublishedReduction:
    scale = unit_factor(unit)[0]
    return PublishedReduction(
        error, "1" if unit == "%" else unit, before * scale, after * scale, run_to_run * scale
    )


# run-to-run of the uncalibrated unit: K table 4.1
_ROWS = (
    ("gyro.bias", "deg/s", 0.015, 0.002, 0.002),
    ("gyro.scale_factor", "%", 0.06, 0.012, 0.002),
    ("accelerometer.bias", "g", 0.007, 0.001, 0.001),
    ("accelerometer.scale_factor", "%", 0.08, 0.025, 0.002),
)


def published() -> tuple[PublishedReduction, ...]:
    """The rows of the table."""
    return tuple(_row(*row) for row in _ROWS)


def published_check(asked: Recalibration) -> Array:
    """(4,) one sigma that our procedure leaves of the published unit, in the order of the table, SI."""
    models = [
        ErrorModel(p.error, p.unit, p.before, ((float("nan"), p.run_to_run),), 0.0, 0.0, p.before, True)
        for p in published()
    ]
    left = sensor_left(asked, models, 1)
    return np.array([left[p.error, "x"] for p in published()])
