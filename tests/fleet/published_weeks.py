"""Gyros in store as K 3.5 has them: 21 known weeks, 14 to forecast. K's own records are not published.

A third drift straight, a third in parabolas, a third in waves, the pictures that K names, by about 0.02 deg/s
in two months (K table 2.18), with 0.0002 deg/s of noise in a weekly mean.
"""

from __future__ import annotations

import numpy as np

from planner.fleet.forecast._method import Forecast, Past
from planner.fleet.validation import method_named

WEEK = 7.0
GYROS, KNOWN, WEEKS = 12, 21, 35


def drifts(rng: np.random.Generator) -> np.ndarray:
    """(12, 35) weekly means, deg/s."""
    week, size = np.arange(float(WEEKS)), 0.02 * rng.normal(1.0, 0.3, (GYROS, 1))
    sign = rng.choice([-1.0, 1.0], (GYROS, 1))
    period, phase = rng.uniform(20, 40, (GYROS, 1)), rng.uniform(0, 1, (GYROS, 1))
    straight = np.tile(week / 8.6, (GYROS, 1))
    shapes = np.stack([straight, straight**2 / 3.0, np.sin(2 * np.pi * (week / period + phase))])
    shape = shapes[np.arange(GYROS) % 3, np.arange(GYROS)]
    return sign * size * shape + 2e-4 * rng.normal(size=(GYROS, WEEKS))


def figures(name: str, values: np.ndarray) -> tuple[float, float, float]:
    """rms error of weeks 22-28 and of 29-35, deg/s; share of the first within the 95 % interval."""
    day = WEEK * np.arange(KNOWN)
    pasts = [Past("gyro.bias", day, v[:KNOWN], np.full(KNOWN, np.nan)) for v in values]
    made = method_named(name).forecast(pasts, [WEEK * np.arange(1, 15)] * GYROS)
    assert all(isinstance(f, Forecast) for f in made), made
    off = np.array([f.mean for f in made]) - values[:, KNOWN:]
    inside = np.abs(off[:, :7]) <= [f.half_width(0.95)[:7] for f in made]
    first, second = (float(np.sqrt(np.mean(off[:, part] ** 2))) for part in (slice(0, 7), slice(7, 14)))
    return first, second, float(inside.mean())
