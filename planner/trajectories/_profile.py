"""Smooth profiles of which the flights are made: steps and pulses with three continuous derivatives."""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array

KNOT_STEP_S = 0.01


def knots(duration: float) -> Array:
    """(m,) instants from 0 to the end, 10 ms apart or slightly less, through which a flight's splines go."""
    return np.linspace(0.0, duration, max(3, round(duration / KNOT_STEP_S)) + 1)


def step(time_s: Array | float, begin: float, end: float) -> Array:
    """Zero before `begin`, one after `end`, between them x⁴ (35 − 84 x + 70 x² − 20 x³)."""
    if isinstance(time_s, float):  # an integrator asks for one instant after another
        x: Array | float = min(max((float(time_s) - begin) / (end - begin), 0.0), 1.0)
    else:
        x = np.clip((np.asarray(time_s) - begin) / (end - begin), 0.0, 1.0)
    return np.asarray(x**4 * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x))))


def step_rate(time_s: Array | float, begin: float, end: float) -> Array:
    """The derivative of `step`: 140 x³ (1 − x)³ / (end − begin)."""
    x = np.clip((np.asarray(time_s) - begin) / (end - begin), 0.0, 1.0)
    return np.asarray(140.0 * (x * (1.0 - x)) ** 3 / (end - begin))


def pulse(time_s: Array | float, begin: float, end: float, rise: float) -> Array:
    """One between `begin` + `rise` and `end` − `rise`, zero outside, smooth in between."""
    return step(time_s, begin, begin + rise) - step(time_s, end - rise, end)
