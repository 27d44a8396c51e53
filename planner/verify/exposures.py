"""What a bench does to a unit during a record: mean rate and specific force, true and as its references say.

A vector r of the bench (x north, y west, z up) is, in a unit on a table whose axes stand at a and b,

    Z Y r = [[cos a cos b,  sin a, −cos a sin b],
             [−sin a cos b, cos a,  sin a sin b],
             [sin b,        0,      cos b      ]] r

Over a record a = a₀ + w₁t, b = b₀ + w₂t; products of sines and cosines are sums of those of a ± b, whose
means over the record are known in closed form. References err by the base's tilt, which turns gravity and
the Earth's rate in the bench; by small angles of the unit on the bench; and by the table's rate.
Written for verify alone; `planner simulate` has its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array
from planner.physics.earth import EARTH_RATE_RADPS
from planner.units import STANDARD_GRAVITY_MPS2

BENCH_LATITUDE = float(np.radians(45.0))
ARM_M = 1.5  # of a centrifuge for which the spec gives none
_STILL = np.zeros(3)


@dataclass(frozen=True)
class Motion:
    """What a bench does during one record.

    turned: (3, 3) mean of a bench vector's components in the unit; driven: (3,) rate that the axes give,
    rad/s; pushed: (3,) specific force that an arm gives, m/s². All in the unit's axes.
    """

    turned: Array
    driven: Array
    pushed: Array


def motion_of(asked: Mapping[str, float] | None, seconds: float, arm: float | None, along: int) -> Motion:
    """From axis positions (deg), rates (deg/s) or a load (g); along: body axis that lies along axis 1."""
    said = asked or {}
    cyclic = np.eye(3)[[(i - along - 1) % 3 for i in range(3)]]  # body axis `along` is where z would be
    if "acceleration_g" in said:
        load = said["acceleration_g"] * STANDARD_GRAVITY_MPS2
        side = np.radians(said.get("position_2_deg", 180.0))
        outward = np.array([np.cos(side), np.sin(side), 0.0])
        spin = np.sqrt(abs(load) / (arm or ARM_M)) * np.array([0.0, 0.0, 1.0])
        upright = np.diag([0.0, 0.0, 1.0])  # what is level turns round with the arm
        return Motion(cyclic @ upright, cyclic @ spin, cyclic @ (-load * outward))
    start = [np.radians(said.get(f"position_{k}_deg", 0.0)) for k in (1, 2)]
    speed = [np.radians(said.get(f"rate_{k}_dps", 0.0)) for k in (1, 2)]
    a = _mean(start[0], speed[0] * seconds)
    b = _mean(start[1], speed[1] * seconds)
    plus = _mean(start[0] + start[1], (speed[0] + speed[1]) * seconds)
    less = _mean(start[0] - start[1], (speed[0] - speed[1]) * seconds)
    cos_cos, sin_sin = (less.real + plus.real) / 2.0, (less.real - plus.real) / 2.0
    sin_cos, cos_sin = (plus.imag + less.imag) / 2.0, (plus.imag - less.imag) / 2.0
    table = np.array(
        [
            [cos_cos, a.imag, -cos_sin],
            [-sin_cos, a.real, sin_sin],
            [b.imag, 0.0, b.real],
        ]
    )
    rate = np.array([speed[1] * a.imag, speed[1] * a.real, speed[0]])
    return Motion(cyclic @ table, cyclic @ rate, _STILL)


def _mean(start: float, sweep: float) -> complex:
    """Mean of exp(i x) over x = start … start + sweep."""
    if abs(sweep) < 1e-9:
        return complex(np.exp(1j * start))
    return complex((np.exp(1j * (start + sweep)) - np.exp(1j * start)) / (1j * sweep))


def along_axis_1(number: int, count: int, axes: int) -> int:
    """Body axis (0, 1, 2) along axis 1 at motion `number` of `count`, from 0.

    On one axis a unit is put up with x, y, z in turn, a third of the motions each; on several it stays.
    """
    if axes > 1 or count < 3:
        return 2
    return min(3 * number // count, 2)


def upward() -> Array:
    """(3,) reaction to gravity in a level bench, m/s²."""
    return np.array([0.0, 0.0, STANDARD_GRAVITY_MPS2])


def earth_rate() -> Array:
    """(3,) in a level bench that looks north, rad/s."""
    return EARTH_RATE_RADPS * np.array([np.cos(BENCH_LATITUDE), 0.0, np.sin(BENCH_LATITUDE)])


def turned_by(angles: Array) -> Array:
    """(..., 3, 3) rotation matrices of rotation vectors (..., 3): I + sinθ/θ K + (1 − cosθ)/θ² K²."""
    x, y, z = np.moveaxis(angles, -1, 0)
    none = np.zeros_like(x)
    K = np.stack([none, -z, y, z, none, -x, -y, x, none], axis=-1).reshape(*x.shape, 3, 3)
    size = np.linalg.norm(angles, axis=-1)[..., None, None]
    first, second = np.sinc(size / np.pi), 0.5 * np.sinc(size / (2.0 * np.pi)) ** 2
    return np.asarray(np.eye(3) + first * K + second * (K @ K))
