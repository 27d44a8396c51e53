"""Sensitivities counted again: the flight navigated with every error a little too large and too small.

    d(navigation error)/d(error) = [flight(+ε) − flight(−ε)] / 2ε

through the nonlinear strapdown at the full sampling rate; no error equation is solved. ε moves the attitude
by 1e-5 rad or the velocity by 0.1 m/s in all, so that what is of third order is 1e-9 of the result, and
rounding of positions (1e-9 m of some metres) no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics.strapdown import integrate, part_of
from planner.protocols import Sensor
from planner.verify.along_flight import apart, conditions_of, height_of, start_of

_TURN = 1e-5  # rad
_PUSH = 0.1  # m/s
_AT_ONCE = 6_000_000  # samples of all flights


@dataclass(frozen=True)
class Slopes:
    """time_s: (m,); position, velocity: (m, 3, p) north, east, up; attitude: roll, pitch, heading."""

    time_s: Array
    position: Array
    velocity: Array
    attitude: Array


def slopes_of(trajectory: Trajectory, errors: Sequence[tuple[Sensor, str]], instants: Array) -> Slopes:
    """Per SI unit of every term of the errors (sensor, effect), in their order; instants in s."""
    n = len(trajectory.angle_increment)
    conditions = conditions_of(trajectory, 0, n)
    parts = []
    for sensor, effect in errors:
        regressors = catalog.effects()[effect].regressors(sensor, conditions)
        count = regressors.shape[2]
        each = max(1, _AT_ONCE // (2 * n))
        parts += [
            _flown(trajectory, sensor, regressors[:, :, i : i + each], instants)
            for i in range(0, count, each)
        ]
    joined = (np.concatenate([getattr(p, k) for p in parts], axis=2) for k in _FIELDS)
    return Slopes(instants, *joined)


_FIELDS = ("position", "velocity", "attitude")


def _flown(trajectory: Trajectory, sensor: Sensor, columns: Array, instants: Array) -> Slopes:
    """columns: (n, 3, p) of one sensor; the flights of both signs are navigated side by side."""
    step = float(trajectory.time_s[1] - trajectory.time_s[0])
    moved = np.abs(columns).sum(axis=(0, 1)) * step
    size = np.where(moved > 0, (_TURN if sensor == "gyro" else _PUSH) / np.where(moved > 0, moved, 1.0), 1.0)
    more = step * np.moveaxis(columns * size, 2, 0)
    angle, velocity = trajectory.angle_increment, trajectory.velocity_increment
    both = (angle if sensor == "gyro" else velocity) + np.concatenate([more, -more])
    flown = integrate(
        start_of(trajectory),
        both if sensor == "gyro" else angle,
        velocity if sensor == "gyro" else both,
        step,
        instants=instants - trajectory.time_s[0],
        height=height_of(trajectory),
    )
    above, below = (part_of(flown, (half,)) for half in (slice(None, len(more)), slice(len(more), None)))
    return Slopes(instants, *(np.moveaxis(x, 0, 2) / (2.0 * size) for x in apart(above, below)))
