"""A vertical channel held by a height aid: altitude and vertical velocity are those of the reference.

Without an aid an error of height grows: gravitation falls with height, δ̈h = 2 g/R δh, by e every 9.5 minutes.
Any barometer, radar or depth sensor keeps it; how it is blended takes seconds to a minute or two, which is
nothing beside half an hour. So the channel is taken as held: after every block of the integration

    h <- h_true,   v_D <- v_D,true

and the aid's own error is added to the computed height at the end. What is left out is of relative size
v_vertical · t · Ω within a block of a second or less, under 1e-4 of what the vertical sensors would add.
"""

from __future__ import annotations

import numpy as np

from planner.physics import earth
from planner.physics.blocks import POSITION, VELOCITY, Indices, Motion
from planner.physics.earth import EARTH_RATE_RADPS, Array

_SPIN = np.array([0.0, 0.0, EARTH_RATE_RADPS])


def hold(position: Array, velocity: Array, altitude: float, down: float) -> tuple[Array, Array]:
    """Position and velocity (3, B) in inertial axes with altitude (m) and velocity down (m/s) as given."""
    latitude, longitude, found = earth.ecef_to_lla(position.T)  # longitude in i; height does not mind
    cos = np.cos(latitude)
    up = np.stack([cos * np.cos(longitude), cos * np.sin(longitude), np.sin(latitude)])
    held = position + up * (altitude - found)
    carried = EARTH_RATE_RADPS * (up[1] * held[0] - up[0] * held[1])  # u · (Ω × r)
    return held, velocity - up * (np.sum(up * velocity, axis=0) - carried + down)


def holding(motion: Motion, at: Indices) -> Array:
    """(m, 9, 9) the same to first order: what it leaves of errors in inertial axes at samples (m,).

    δr' = (I − d dᵀ) δr,   δv' = δv − d {d · (δv − Ω × δr') − (v_N n/(R_N+h) + v_E e/(R_E+h)) · δr'}

    n, e, d: local north, east and down; the last term is the tilt of the computed frame times velocity.
    """
    c_in = local_to_inertial(motion, at)
    north, east, down = (c_in[:, :, k] for k in range(3))
    meridian, transverse = earth.principal_radii(motion.latitude[at])
    height, v = motion.altitude[at], motion.velocity[at]
    tilted = (v[:, 0] / (meridian + height))[:, None] * north
    tilted += (v[:, 1] / (transverse + height))[:, None] * east
    level = np.eye(3) - down[:, :, None] * down[:, None, :]
    found = np.zeros((len(at), 9, 9))
    found[:, range(9), range(9)] = 1.0
    found[:, POSITION, POSITION] = level
    found[:, VELOCITY, VELOCITY] = level
    across = np.cross(down, _SPIN) + tilted  # d · (Ω × δr) = (d × Ω) · δr
    found[:, VELOCITY, POSITION] = down[:, :, None] * (across[:, None, :] @ level)
    return found


def local_to_inertial(motion: Motion, at: Indices) -> Array:
    """C_in (m, 3, 3) at samples (m,); its columns are north, east and down."""
    turned = EARTH_RATE_RADPS * (motion.time_s[at] - motion.time_s[0])
    return earth.ecef_from_ned(motion.latitude[at], motion.longitude[at] + turned)
