"""Nonlinear navigation of many runs of one flight, each with its own small sensor errors.

A run's readings are those of the flight plus a linear combination of given columns. In the inertial frame
its attitude is Ĉ = Q B(t) C(t): C the flight's own, Q the rotation that the run has gathered before this
block, B the small one inside the block, linear in the errors. So one matrix product takes all runs through
a block of samples, and only Q, velocity, position and gravitation are per run. With u = response ·
coefficients and Δγ = γ(r + δr) - γ(r)

    δv += Q (X + u_v + s_v) - X + ∫Δγ,   δr += δv T + Q (Y + u_r + s_r) - Y + ∫∫Δγ,   Q <- Q exp[u_φ ×]

Nothing is linearised over the flight: rotations, positions and gravitation are exact for errors of any size.
What is of second order inside a block is taken as if force and errors were constant there,

    s_v = u_φ × (u_v - u_φ × X/6)/2,   s_r = u_φ × (u_r - u_φ × Y/12)/3
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner.physics import earth, quaternion
from planner.physics.attitude import rph_from_dcm, wrapped
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
    pieces,
)
from planner.physics.earth import Array
from planner.physics.error_dynamics import ErrorHistory
from planner.physics.quaternion import cross
from planner.physics.strapdown import NavigationState, from_inertial, part_of, to_inertial
from planner.physics.vertical import hold


def navigate_with_errors(
    motion: Motion,
    forcing: Forcing,
    coefficients: Array,
    *,
    block_s: float = 0.25,
    instants: Sequence[float] | None = None,
    active: Active | None = None,
    blocks: Sequence[Blocks] | None = None,
) -> ErrorHistory:
    """Navigation errors of B runs whose readings are off by forcing · coefficients.

    coefficients: (B, p) per run and column, gyro columns first
    instants: times (s) of the errors wanted, to the nearest sample; None for the end
    active: which of the p columns the forcing gives over some samples; None: all of them, always
    blocks: `pieces` between the edges of block_s and instants, where they are known
    Returns errors (k, 3, B), computed - true, at k instants; angles wrapped to ±π.
    """
    wanted = [float(motion.time_s[-1])] if instants is None else instants
    edges = block_edges(motion.time_s, block_s, wanted)
    time = motion.time_s[edges] - motion.time_s[0]
    at = [int(np.argmin(np.abs(motion.time_s[edges] - t))) for t in wanted]
    true = _states(motion, edges)
    c_bi, velocity, position = to_inertial(true, time)
    steps = _steps(pieces(motion, forcing, edges) if blocks is None else blocks, coefficients, active)
    aid = _Aid(true, velocity.T, position.T) if motion.height_aid_m is not None else None
    turn, dv, dr = _run(steps, position, len(coefficients), at, aid)
    computed = from_inertial(
        quaternion.to_matrix(turn) @ c_bi[at, None],
        velocity[at, None] + dv,
        position[at, None] + dr,
        time[at, None],
    )
    return _difference(computed, part_of(true, (at, None)), motion.time_s[edges[at]])


_Step = tuple[float, Array, Array, Array]  # duration, X (3, 1), Y (3, 1), u (9, B)


def _steps(several: Iterable[Blocks], coefficients: Array, active: Active | None) -> Iterator[_Step]:
    """Block after block, what the errors of every run leave at its end."""
    for blocks in several:
        own = coefficients
        if active is not None:
            own = coefficients[:, active(int(blocks.edges[0]), int(blocks.edges[-1]))]
        u = blocks.response @ own.T
        force, moment = blocks.force[:, :, None], blocks.force_moment[:, :, None]
        yield from zip(blocks.duration.tolist(), force, moment, u, strict=True)


@dataclass(frozen=True)
class _Aid:
    """What holds the height of every run: the true flight at the edges; velocity, position (3, b + 1)."""

    true: NavigationState
    velocity: Array
    position: Array

    def held(self, k: int, dr: Array, dv: Array) -> tuple[Array, Array]:
        """δr and δv (3, B) at edge k with the height and the vertical velocity of the true flight."""
        r, v = self.position[:, k, None], self.velocity[:, k, None]
        altitude, down = float(self.true.altitude[k]), float(self.true.velocity[k, 2])
        position, velocity = hold(r + dr, v + dv, altitude, down)
        return position - r, velocity - v


def _run(
    steps: Iterator[_Step], position: Array, runs: int, at: Sequence[int], aid: _Aid | None
) -> tuple[Array, Array, Array]:
    """Q (4, k, B), δv and δr (k, B, 3) in inertial axes at the edges `at`; position (b + 1, 3) is true."""
    turn, dv, dr = np.zeros((4, runs)), np.zeros((3, runs)), np.zeros((3, runs))
    turn[0] = 1.0
    gravitation = earth.gravitation(position)
    before = np.zeros((3, runs))
    history = {0: (turn, dv, dr)}
    for k, (t, x, y, u) in enumerate(steps):
        angle, pushed, carried = u[ROTATION], u[VELOCITY], u[POSITION]
        pushed = pushed + cross(angle, pushed - cross(angle, x / 6.0)) / 2.0
        carried = carried + cross(angle, carried - cross(angle, y / 12.0)) / 3.0
        moved = dr + dv * t + quaternion.rotated(turn, y + carried) - y
        there = position[k + 1, :, None] + moved + before * (t * t / 2.0)
        after = (earth.gravitation(there.T) - gravitation[k + 1]).T
        dr = moved + (before / 3.0 + after / 6.0) * (t * t)
        dv = dv + quaternion.rotated(turn, x + pushed) - x + (before + after) * (t / 2.0)
        turn = quaternion.product(turn, quaternion.from_rotation_vector(angle))
        before = after
        if aid is not None:
            dr, dv = aid.held(k + 1, dr, dv)
        if k + 1 in at:
            history[k + 1] = (turn, dv, dr)
    turns, velocities, positions = (
        np.stack(part, axis=1) for part in zip(*(history[k] for k in at), strict=True)
    )
    return turns, np.moveaxis(velocities, 0, 2), np.moveaxis(positions, 0, 2)


def _states(motion: Motion, at: Indices) -> NavigationState:
    return NavigationState(
        motion.latitude[at],
        motion.longitude[at],
        motion.altitude[at],
        motion.velocity[at],
        motion.attitude[at],
    )


def _difference(computed: NavigationState, true: NavigationState, time_s: Array) -> ErrorHistory:
    """Errors as `error_dynamics` defines them, each in its own local frame."""
    meridian, transverse = earth.principal_radii(true.latitude)
    position = [
        (computed.latitude - true.latitude) * (meridian + true.altitude),
        wrapped(computed.longitude - true.longitude) * (transverse + true.altitude) * np.cos(true.latitude),
        computed.altitude - true.altitude,
    ]
    velocity = (computed.velocity - true.velocity) * np.array([1.0, 1.0, -1.0])
    angles = [
        wrapped(a - b)
        for a, b in zip(rph_from_dcm(computed.attitude), rph_from_dcm(true.attitude), strict=True)
    ]
    return ErrorHistory(time_s, np.stack(position, axis=1), velocity.swapaxes(1, 2), np.stack(angles, axis=1))
