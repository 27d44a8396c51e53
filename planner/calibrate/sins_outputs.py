"""Sensor errors from what a strapdown system puts out at rest, instead of raw sensors (K 2.3, eqs. 22-26).

Axes X East, Y North, Z Up; α, β, γ small attitude errors, u Earth's rate, φ latitude. At rest
    Δω_x = dα/dt − u sinφ β + u cosφ γ,   Δω_y = dβ/dt + u sinφ α,   Δω_z = dγ/dt − u cosφ α
    Δn_1 = dV_1/dt + β g,                 Δn_2 = dV_2/dt − α g,      Δn_3 = dV_3/dt       (n = (0, 0, g))
with the Coriolis terms 2 Ω × V kept. Integrated over the record each is a straight line in time, whose slope
is the error: no derivative of noisy outputs is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.errors import InputError
from planner.nouns.array import Array
from planner.physics.earth import EARTH_RATE_RADPS
from planner.units import STANDARD_GRAVITY_MPS2

LEAST_SAMPLES = 10


@dataclass(frozen=True)
class SinsRest:
    """Outputs at one rest. time: (n,) s; attitude: (n, 3) α, β, γ rad; velocity: (n, 3) m/s East, North, Up

    C: (3, 3) body to East, North, Up; latitude: rad
    """

    time: Array
    attitude: Array
    velocity: Array
    C: Array
    latitude: float


@dataclass(frozen=True)
class SensorErrors:
    """Mean errors of the sensors in body axes. gyro: (3,) rad/s; acc: (3,) m/s²; *_error: of the slopes."""

    gyro: Array
    acc: Array
    gyro_error: Array
    acc_error: Array


def sensor_errors(rest: SinsRest) -> SensorErrors:
    """Errors of gyros and accelerometers at one rest.

    Raises InputError for too few samples, time that does not rise, or outputs that are no numbers.
    """
    _check(rest)
    earth = EARTH_RATE_RADPS * np.array([0.0, np.cos(rest.latitude), np.sin(rest.latitude)])
    up = np.array([0.0, 0.0, STANDARD_GRAVITY_MPS2])
    # dθ/dt = −Ω × θ + Δω and dV/dt = −2 Ω × V + n × θ … in components the equations above
    turned = rest.attitude - rest.attitude[0] + _integral(rest.time, np.cross(earth, rest.attitude))
    pushed = _integral(rest.time, 2.0 * np.cross(earth, rest.velocity) - np.cross(up, rest.attitude))
    gained = rest.velocity - rest.velocity[0] + pushed
    (gyro, gyro_error), (acc, acc_error) = (_slope(rest.time, line) for line in (turned, gained))
    back = rest.C.T
    return SensorErrors(
        back @ gyro, back @ acc, np.sqrt(back**2 @ gyro_error**2), np.sqrt(back**2 @ acc_error**2)
    )


def _check(rest: SinsRest) -> None:
    if len(rest.time) < LEAST_SAMPLES or (np.diff(rest.time) <= 0).any():
        raise InputError(f"outputs of a rest need {LEAST_SAMPLES} samples at least, with time that rises")
    if not (np.isfinite(rest.attitude).all() and np.isfinite(rest.velocity).all()):
        raise InputError("outputs of a rest hold NaN or infinite numbers")
    if np.abs(rest.attitude).max() > np.radians(5.0):
        raise InputError(
            "attitude errors over 5 deg: the equations are of small angles; are these whole angles?"
        )


def _integral(time: Array, rate: Array) -> Array:
    """(n, 3) trapezoidal integral from the first sample."""
    step = np.diff(time)[:, None] * (rate[1:] + rate[:-1]) / 2.0
    return np.vstack([np.zeros((1, 3)), np.cumsum(step, axis=0)])


def _slope(time: Array, line: Array) -> tuple[Array, Array]:
    """(3,) slope of a straight line and its standard error."""
    t = time - time.mean()
    slope = t @ line / (t @ t)
    left = line - line.mean(axis=0) - t[:, None] * slope
    return slope, np.sqrt(np.sum(left**2, axis=0) / ((len(t) - 2) * (t @ t)))
