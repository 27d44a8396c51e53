"""From a smooth motion to a trajectory whose position, velocity, attitude and ideal readings belong together.

A motion is two splines over time: the velocity in north-east-down axes and the attitude. Everything else is
derived from these two without further approximation than quadrature:

    φ' = v_N / (R_N + h),  λ' = v_E / ((R_E + h) cosφ),  h' = −v_D                       (Groves 5.56)
    ω_ib^b = ω_nb^b + C_bn (ω_ie^n + ω_en^n)
    f^b = C_bn (dv^n/dt + (2 ω_ie^n + ω_en^n) × v^n − g^n)                                (Groves 5.53)
    angle_increment[k] = ∫ ω_ib^b dt,  velocity_increment[k] = ∫ f^b dt     over [t_k, t_k+1], body frame

The integrals are three-point Gauss-Legendre in every panel: over 10 ms their error is below 1e-12 rad and
1e-9 m/s even at 80 g and 1 rad/s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics.attitude import cross, rotate
from planner.physics.earth import (
    earth_rate_ned,
    gravity_ned,
    principal_radii,
    transport_rate_ned,
)
from planner.trajectories._parameters import Environment

Curve = Callable[[Array], Array]

_PANELS_AT_ONCE = 20_000  # 60 000 nodes: some 50 MB of working arrays, whatever the length of the flight

# Gauss-Legendre on [0, 1], three nodes; _INNER[i, j] integrates the j-th Lagrange polynomial from 0 to node i
_NODES = 0.5 + np.sqrt(0.15) * np.array([-1.0, 0.0, 1.0])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
_R = np.sqrt(15.0)
_INNER = np.array(
    [
        [5 / 36, 2 / 9 - _R / 15, 5 / 36 - _R / 30],
        [5 / 36 + _R / 24, 2 / 9, 5 / 36 - _R / 24],
        [5 / 36 + _R / 30, 2 / 9 + _R / 15, 5 / 36],
    ]
)


class Position(NamedTuple):
    """Latitude and longitude in rad, altitude in m: numbers or arrays of one shape."""

    latitude: float | Array
    longitude: float | Array
    altitude: float | Array


@dataclass(frozen=True)
class Motion:
    """Velocity and attitude as smooth functions of time, (k,) instants in, one row an instant out.

    velocity: (k, 3) north, east, down in m/s; acceleration: (k, 3) its derivative
    quaternion: (k, 4) proportional to the attitude quaternion (scalar first, body to north-east-down), of any
    length; quaternion_rate: (k, 4) its derivative
    """

    velocity: Curve
    acceleration: Curve
    quaternion: Curve
    quaternion_rate: Curve


def motion_through(time_s: Array, velocity: Array, quaternion: Array) -> Motion:
    """The motion through samples: time_s (m,), velocity (m, 3), quaternion (m, 4); m >= 2.

    Cubic splines, so acceleration and angular rate are continuous with their first derivatives between the
    samples' own. The spline of the quaternion is linear in it, hence the same motion in whatever frame the
    attitude is written, and has no singular attitude. Signs may jump; they are aligned here.
    """
    from scipy.interpolate import CubicSpline

    v = CubicSpline(time_s, velocity)
    q = CubicSpline(time_s, _aligned(quaternion))
    return Motion(v, partial(v, nu=1), q, partial(q, nu=1))


def quaternion_from_rph(roll: Array, pitch: Array, heading: Array) -> Array:
    """(m, 4) unit quaternions, scalar first, of R_z(heading) R_y(pitch) R_x(roll)."""
    (sr, sp, sh), (cr, cp, ch) = (
        [function(0.5 * angle) for angle in np.broadcast_arrays(roll, pitch, heading)]
        for function in (np.sin, np.cos)
    )
    return np.stack(
        [
            cr * cp * ch + sr * sp * sh,
            sr * cp * ch - cr * sp * sh,
            cr * sp * ch + sr * cp * sh,
            cr * cp * sh - sr * sp * ch,
        ],
        axis=-1,
    )


def fly(
    name: str, motion: Motion, start: Position, time_s: Array, environment: Environment, *, panels: int = 1
) -> Trajectory:
    """The trajectory of a motion from a starting point, on the uniform grid time_s (n + 1,).

    panels: quadrature panels per interval, for motions whose knots are closer than the grid.
    Bounded memory beside the result itself: works through the flight in pieces.
    """
    pieces = [_Piece(_columns(start), np.empty((0, 3)), np.empty((0, 3)))]
    intervals = max(1, _PANELS_AT_ONCE // panels)
    for first in range(0, len(time_s) - 1, intervals):
        here = Position(*pieces[-1].positions[-1])
        pieces.append(_fly_piece(motion, here, time_s[first : first + intervals + 1], panels))
    latitude, longitude, altitude = np.concatenate([piece.positions for piece in pieces]).T
    return Trajectory(
        name=name,
        time_s=time_s,
        latitude=latitude,
        longitude=longitude,
        altitude=altitude,
        velocity=motion.velocity(time_s),
        attitude=dcm_from_quaternion(motion.quaternion(time_s)),
        angle_increment=np.concatenate([piece.angle_increment for piece in pieces]),
        velocity_increment=np.concatenate([piece.velocity_increment for piece in pieces]),
        temperature_degc=environment.temperature_degc(time_s),
        time_on=environment.time_on + time_s,
        day=environment.days,
    )


def readings(motion: Motion, time_s: Array, position: Position) -> tuple[Array, Array]:
    """Ideal rate (k, 3) in rad/s and specific force (k, 3) in m/s², body axes, at instants and places."""
    v, a = motion.velocity(time_s), motion.acceleration(time_s)
    q, q_rate = motion.quaternion(time_s), motion.quaternion_rate(time_s)
    earth = earth_rate_ned(position.latitude)
    transport = transport_rate_ned(position.latitude, position.altitude, v)
    force = a + cross(2.0 * earth + transport, v) - gravity_ned(position.latitude, position.altitude)
    to_body = np.swapaxes(dcm_from_quaternion(q), -1, -2)
    return _body_rate(q, q_rate) + rotate(to_body, earth + transport), rotate(to_body, force)


@dataclass(frozen=True)
class _Piece:
    """k intervals: positions (k, 3) at their ends as latitude, longitude, altitude, and increments (k, 3)."""

    positions: Array
    angle_increment: Array
    velocity_increment: Array


def _columns(position: Position) -> Array:
    """(k, 3) latitude, longitude, altitude."""
    return np.stack([np.atleast_1d(np.asarray(x, dtype=float)) for x in position], axis=1)


def _fly_piece(motion: Motion, start: Position, time_s: Array, panels: int) -> _Piece:
    """Flies the intervals between time_s (k + 1,), each of `panels` quadrature panels."""
    length = np.repeat(np.diff(time_s) / panels, panels)
    begin = np.repeat(time_s[:-1], panels) + length * np.tile(np.arange(panels), len(time_s) - 1)
    nodes = begin[:, np.newaxis] + length[:, np.newaxis] * _NODES
    at_ends, at_nodes = _positions(motion, start, nodes, length)
    turned, gained = (
        np.einsum("kpjc,j,kp->kc", x.reshape(-1, panels, 3, 3), _WEIGHTS, length.reshape(-1, panels))
        for x in readings(motion, nodes.ravel(), at_nodes)
    )
    return _Piece(_columns(at_ends)[panels::panels], turned, gained)


def _positions(motion: Motion, start: Position, nodes: Array, length: Array) -> tuple[Position, Position]:
    """Positions at the panels' ends (k + 1,) and at their nodes (3 k,): Gauss collocation of order six.

    The latitude depends on itself only through the radii: Picard's iteration gains several digits a round.
    """
    velocity = motion.velocity(nodes.ravel()).reshape(*nodes.shape, 3)
    altitude = _integral(start.altitude, -velocity[..., 2], length)
    latitude = (np.empty(0), np.full(nodes.shape, start.latitude))
    for _ in range(4):
        meridian, _unused = principal_radii(latitude[1])
        latitude = _integral(start.latitude, velocity[..., 0] / (meridian + altitude[1]), length)
    _unused, transverse = principal_radii(latitude[1])
    radius = (transverse + altitude[1]) * np.cos(latitude[1])
    longitude = _integral(start.longitude, velocity[..., 1] / radius, length)
    ends, inner = ([x[i] for x in (latitude, longitude, altitude)] for i in (0, 1))
    return Position(*ends), Position(*(x.ravel() for x in inner))


def _integral(start: float | Array, slope: Array, length: Array) -> tuple[Array, Array]:
    """start + ∫ slope dt, slope (k, 3) at the nodes: at the panels' ends (k + 1,), at the nodes (k, 3)."""
    steps = length * (slope @ _WEIGHTS)
    ends = start + np.concatenate([[0.0], np.cumsum(steps)])
    return ends, ends[:-1, np.newaxis] + length[:, np.newaxis] * (slope @ _INNER.T)


def dcm_from_quaternion(quaternion: Array) -> Array:
    """C (k, 3, 3) of quaternions (k, 4), scalar first, of any length but zero (Groves 2.34)."""
    w, x, y, z = np.moveaxis(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True), -1, 0)
    matrix = np.empty((*w.shape, 3, 3))
    matrix[..., 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    matrix[..., 0, 1] = 2.0 * (x * y - w * z)
    matrix[..., 0, 2] = 2.0 * (x * z + w * y)
    matrix[..., 1, 0] = 2.0 * (x * y + w * z)
    matrix[..., 1, 1] = 1.0 - 2.0 * (x * x + z * z)
    matrix[..., 1, 2] = 2.0 * (y * z - w * x)
    matrix[..., 2, 0] = 2.0 * (x * z - w * y)
    matrix[..., 2, 1] = 2.0 * (y * z + w * x)
    matrix[..., 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    return matrix


def _body_rate(q: Array, q_rate: Array) -> Array:
    """ω (k, 3) in body axes of a quaternion of any length: ω = 2 Im(q* q') / |q|²."""
    scalar, vector = q[:, :1], q[:, 1:]
    imaginary = scalar * q_rate[:, 1:] - q_rate[:, :1] * vector - cross(vector, q_rate[:, 1:])
    return np.asarray(2.0 * imaginary / np.sum(q * q, axis=1, keepdims=True))


def _aligned(quaternion: Array) -> Array:
    """The same attitudes with signs chosen so that neighbours are on one side."""
    flips = np.where(np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0.0, -1.0, 1.0)
    sign = np.concatenate([[1.0], np.cumprod(flips)])
    return np.asarray(quaternion * sign[:, np.newaxis])
