"""Linear navigation error equations: what small errors of the sensors do to position, velocity and attitude.

In the inertial frame i (the e frame at time zero) with C = C_bi, computed = true + error,

    φ'  = C δω                          attitude:  Ĉ = (I + [φ×]) C
    δv' = φ × f + C δf + Γ(t) δr        f specific force in i axes
    δr' = δv

No term is left out: the Earth's rotation and the curvature of the local frame come in when the errors are
turned to north, east, up at the end, the Schuler and vertical loops are in

    Γ = ∂(gravitation)/∂r = C_in G C_ni - Ω² diag(1, 1, 0),
    G = [[-g/(R_N+h), 0, 0], [0, -g/(R_E+h), 0], [∂g/∂φ/(R_N+h), 0, -∂g/∂h]]   on north, east, down.

φ is a pure integral and Γ is slow, so a flight is cut into blocks of about a second. What an error leaves at
the end of its block needs only tail sums of the specific force, and all columns come from matrix products,
see `planner.physics.blocks`; the blocks are chained by

    Φ = [[I, 0, 0], [-[X×], I + ΓT²/2, ΓT], [-[Y×], (I + ΓT²/6) T, I + ΓT²/2]],  X = ∫f dt, Y = ∫(T-t) f dt.

A height aid projects the vertical channel out after every block (planner.physics.vertical).

Neglected: Γ acting on what arises inside the same block (1e-7 of it for one second).
Source of the error model: P. D. Groves, 2nd edition, section 14.2.2; the block form is our own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.physics import earth
from planner.physics.attitude import skew
from planner.physics.blocks import (
    POSITION,
    ROTATION,
    VELOCITY,
    Active,
    Blocks,
    Forcing,
    Indices,
    Motion,
    block_edges,
    cut_into_blocks,
    pieces,
)
from planner.physics.earth import EARTH_RATE_RADPS, Array
from planner.physics.vertical import holding, local_to_inertial

_DOWN_TO_UP = np.array([1.0, 1.0, -1.0])[:, None]


@dataclass(frozen=True)
class ErrorHistory:
    """Navigation errors, computed - true, per unit of every column; gyro columns first, then accelerometers.

    time_s: (m,) instants from the start to the end of the flight
    position: (m, 3, p) north, east, up along the true local axes, m
    velocity: (m, 3, p) north, east, up, m/s: each velocity in its own local frame
    attitude: (m, 3, p) roll, pitch, heading, rad: each against its own local frame
    """

    time_s: Array
    position: Array
    velocity: Array
    attitude: Array


def propagate_errors(
    motion: Motion, forcing: Forcing, *, block_s: float = 1.0, instants: Sequence[float] = ()
) -> ErrorHistory:
    """Errors of navigation that the forcing causes, from zero at the start, at every block's end.

    block_s: distance of the instants of the history, at most a 60th of the flight
    instants: further times (s) at which the history shall have an entry, to the nearest sample
    """
    blocks = cut_into_blocks(motion, forcing, block_s, instants)
    state = np.zeros((len(blocks.edges), 9, blocks.response.shape[2]))
    state[1:], transitions = _held(motion, blocks)
    for step, before, after in zip(transitions, state[:-1], state[1:], strict=True):
        after += step @ before
    return _in_local_axes(motion, blocks.edges, state)


def errors_at(
    motion: Motion, forcing: Forcing, active: Active, count: int, instants: Sequence[float]
) -> ErrorHistory:
    """The same at some instants (s) only, of `count` columns of which a few act at a time.

    An hour of flight with a column for every minute of every error then needs no more than a minute of it.
    """
    edges = block_edges(motion.time_s, 1.0, instants)
    at = [int(np.argmin(np.abs(motion.time_s[edges] - t))) for t in instants]
    state, wanted = np.zeros((9, count)), frozenset(at)
    kept, k = {0: state}, 0
    for blocks in pieces(motion, forcing, edges):
        acting = active(int(blocks.edges[0]), int(blocks.edges[-1]))
        responses, transitions = _held(motion, blocks)
        through, own = np.eye(9), np.zeros((9, len(acting)))  # what was before, and what acts in this piece
        for step, response in zip(transitions, responses, strict=True):
            through, own = step @ through, step @ own + response
            k += 1
            if k in wanted:
                kept[k] = _after(through, state, acting, own)
        state = _after(through, state, acting, own)
    return _in_local_axes(motion, edges[at], np.stack([kept[k] for k in at]))


def _after(through: Array, state: Array, acting: Indices, own: Array) -> Array:
    """(9, p) the state that a piece of the flight makes of `state`, and of the columns that act in it."""
    found = through @ state
    found[:, acting] += own
    return np.asarray(found)


def _held(motion: Motion, blocks: Blocks) -> tuple[Array, Array]:
    """Response (b, 9, p) and Φ (b, 9, 9) of every block, the vertical channel held at its end by an aid."""
    transitions = _transitions(motion, blocks)
    if motion.height_aid_m is None:
        return blocks.response, transitions
    end = holding(motion, blocks.edges[1:])
    return end @ blocks.response, end @ transitions


def _transitions(motion: Motion, blocks: Blocks) -> Array:
    """Φ (b, 9, 9) of the module's equation, Γ taken in the middle of each block."""
    gamma = gravity_gradient(motion, (blocks.edges[:-1] + blocks.edges[1:]) // 2)
    duration = blocks.duration[:, None, None]
    phi = np.zeros((len(gamma), 9, 9))
    phi[:, np.arange(9), np.arange(9)] = 1.0
    phi[:, VELOCITY, ROTATION] = -skew(blocks.force)
    phi[:, POSITION, ROTATION] = -skew(blocks.force_moment)
    phi[:, VELOCITY, VELOCITY] += gamma * duration**2 / 2.0
    phi[:, POSITION, POSITION] += gamma * duration**2 / 2.0
    phi[:, VELOCITY, POSITION] = gamma * duration
    phi[:, POSITION, VELOCITY] = np.eye(3) * duration + gamma * duration**3 / 6.0
    return phi


def gravity_gradient(motion: Motion, at: Indices) -> Array:
    """Γ (B, 3, 3) in inertial axes, 1/s²: the gradient of gravitation with respect to position."""
    latitude, altitude = motion.latitude[at], motion.altitude[at]
    meridian, transverse = earth.principal_radii(latitude)
    small = 1e-4  # rad; the central difference of a smooth function is good to 1e-8 of the slope
    slope = (earth.gravity(latitude + small, altitude) - earth.gravity(latitude - small, altitude)) / (
        2.0 * small
    )
    g = earth.gravity(latitude, altitude)
    gradient = np.zeros((len(at), 3, 3))
    gradient[:, 0, 0] = -g / (meridian + altitude)
    gradient[:, 1, 1] = -g / (transverse + altitude)
    gradient[:, 2, 0] = slope / (meridian + altitude)
    gradient[:, 2, 2] = earth.gravity(latitude, altitude - 0.5) - earth.gravity(latitude, altitude + 0.5)
    c_in = local_to_inertial(motion, at)
    return c_in @ gradient @ c_in.swapaxes(1, 2) - np.diag([1.0, 1.0, 0.0]) * EARTH_RATE_RADPS**2


def _in_local_axes(motion: Motion, at: Indices, state: Array) -> ErrorHistory:
    """Inertial errors (m, 9, p) to what a user sees.

    δr^n = C_ni δr;   ε = (δr_E/(R_E+h), -δr_N/(R_N+h), -δr_E tanφ/(R_E+h))   tilt of the computed local frame
    δv^n = C_ni (δv - Ω × δr) - ε × v^n;   ψ = C_ni φ - ε, then ψ to roll, pitch, heading
    """
    to_local = local_to_inertial(motion, at).swapaxes(1, 2)
    rotation, velocity, position = (state[:, part] for part in (ROTATION, VELOCITY, POSITION))
    relative = velocity.copy()
    relative[:, 0] += EARTH_RATE_RADPS * position[:, 1]
    relative[:, 1] -= EARTH_RATE_RADPS * position[:, 0]
    local_position = to_local @ position
    # the transport rate is linear in velocity, so it also maps a displacement to the turn of the local frame
    tilt = earth.transport_rate_ned(
        motion.latitude[at, None], motion.altitude[at, None], local_position.swapaxes(1, 2)
    ).swapaxes(1, 2)
    local_velocity = to_local @ relative - np.cross(tilt, motion.velocity[at, :, None], axis=1)
    return ErrorHistory(
        time_s=motion.time_s[at],
        position=local_position * _DOWN_TO_UP,
        velocity=local_velocity * _DOWN_TO_UP,
        attitude=_euler_errors(motion.attitude[at], to_local @ rotation - tilt),
    )


def _euler_errors(c_nb: Array, psi: Array) -> Array:
    """Roll, pitch, heading errors (m, 3, p) of a small rotation ψ (m, 3, p), Ĉ_nb = (I + [ψ×]) C_nb.

        δroll = (ψ_N cosψ + ψ_E sinψ) / cosθ;  δpitch = ψ_E cosψ - ψ_N sinψ;  δheading = ψ_D + δroll sinθ

    They grow without bound as the pitch θ nears ±90 deg, as the angles themselves do.
    """
    forward = c_nb[:, :, 0]
    level = np.hypot(forward[:, 0], forward[:, 1])[:, None]
    safe = np.maximum(level, 1e-12)
    cos, sin = forward[:, 0, None] / safe, forward[:, 1, None] / safe
    roll = (cos * psi[:, 0] + sin * psi[:, 1]) / safe
    pitch = cos * psi[:, 1] - sin * psi[:, 0]
    return np.stack([roll, pitch, psi[:, 2] - roll * forward[:, 2, None]], axis=1)
