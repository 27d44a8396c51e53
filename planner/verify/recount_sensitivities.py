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
from planner.physics.attitude import rph_from_dcm
from planner.physics.earth import principal_radii
from planner.physics.strapdown import NavigationState, integrate
from planner.protocols import Sensor
from planner.records import Array, Trajectory
from planner.verify.along_flight import conditions_of

_TURN = 1e-5  # rad
_PUSH = 0.1  # m/s
_AT_ONCE = 2_000_000  # samples of all flights


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
    """columns: (n, 3, p) of one sensor."""
    step = float(trajectory.time_s[1] - trajectory.time_s[0])
    moved = np.abs(columns).sum(axis=(0, 1)) * step
    size = np.where(moved > 0, (_TURN if sensor == "gyro" else _PUSH) / np.where(moved > 0, moved, 1.0), 1.0)
    more = step * np.moveaxis(columns * size, 2, 0)
    angle, velocity = trajectory.angle_increment, trajectory.velocity_increment
    ends = [
        integrate(
            _start(trajectory),
            angle + sign * more if sensor == "gyro" else angle,
            velocity if sensor == "gyro" else velocity + sign * more,
            step,
            instants=instants - trajectory.time_s[0],
        )
        for sign in (1.0, -1.0)
    ]
    position, speed, attitude = _between(*ends)
    return Slopes(instants, *(x / (2.0 * size) for x in (position, speed, attitude)))


def _start(trajectory: Trajectory) -> NavigationState:
    t = trajectory
    return NavigationState(t.latitude[0], t.longitude[0], t.altitude[0], t.velocity[0], t.attitude[0])


def _between(plus: NavigationState, minus: NavigationState) -> tuple[Array, Array, Array]:
    """(m, 3, p) north, east, up; the velocities; roll, pitch, heading: of states (p, m), plus − minus."""
    meridian, transverse = principal_radii(minus.latitude)
    longitude = _wrapped(plus.longitude - minus.longitude)
    position = [
        (plus.latitude - minus.latitude) * (meridian + minus.altitude),
        longitude * (transverse + minus.altitude) * np.cos(minus.latitude),
        plus.altitude - minus.altitude,
    ]
    speed = np.moveaxis((plus.velocity - minus.velocity) * np.array([1.0, 1.0, -1.0]), (0, 1, 2), (2, 0, 1))
    pairs = zip(rph_from_dcm(plus.attitude), rph_from_dcm(minus.attitude), strict=True)
    angles = [_wrapped(a - b) for a, b in pairs]
    return (
        np.moveaxis(np.stack(position), (0, 1, 2), (1, 2, 0)),
        speed,
        np.moveaxis(np.stack(angles), (0, 1, 2), (1, 2, 0)),
    )


def _wrapped(angle: Array) -> Array:
    return np.asarray(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)
