"""Nonlinear strapdown navigation of a batch of flights, without a loop over the samples of a flight.

Mechanisation in the inertial frame i, the e frame at time zero (Groves, 2nd edition, section 5.1):

    C'_bi = C_bi [ω×],   v' = C_bi f + γ(r),   r' = v,        γ = gravity - Ω × (Ω × r)

There the attitude and ∫C f dt inside a block of samples depend on nothing outside the block. So the blocks
of all flights are integrated side by side, sample by sample, each from its own first body frame, and are
then chained with gravitation, which changes little in a block and needs no sample rate. A flight of n
samples takes about 3 √n steps of NumPy, however many flights there are.

Increments are what ideal integrating sensors put out, ∫ω dt and ∫f dt over each interval, component by
component in the turning body. Coning and sculling follow from the neighbouring increments, as if rate and
force were smooth; see `compensate`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.physics import earth, quaternion
from planner.physics.attitude import rotate
from planner.physics.blocks import Indices
from planner.physics.earth import EARTH_RATE_RADPS, Array
from planner.physics.quaternion import cross
from planner.physics.vertical import hold

HELD_S = 1.0  # how often an aid holds the height
_SLICE_SAMPLES = 200_000  # samples of all flights handled at once: 20 MB of working memory
_CACHE_SAMPLES = 12_000  # and those prepared at once, which should stay in the cache


@dataclass(frozen=True)
class NavigationState:
    """Where a flight is; any common leading shape (...).

    latitude, longitude: (...) rad; altitude: (...) m; velocity: (..., 3) north, east, down, m/s
    attitude: (..., 3, 3) C_nb
    """

    latitude: Array
    longitude: Array
    altitude: Array
    velocity: Array
    attitude: Array


def integrate(
    start: NavigationState,
    angle_increment: Array,
    velocity_increment: Array,
    step_s: float,
    *,
    instants: Sequence[float] | None = None,
    height: tuple[Array, Array] | None = None,
) -> NavigationState:
    """Navigate from `start` by the readings of one flight or of many.

    start: one state, or one per flight (B,)
    angle_increment, velocity_increment: (n, 3) or (B, n, 3), rad and m/s per interval of step_s seconds;
        what is the same for all flights may be given once
    instants: times (s) of the states wanted, to the nearest sample; None for the end
    height: (n + 1,) altitude (m) and velocity down (m/s) that an aid holds; None: nothing does
    Returns states of shape (B,), with instants (B, k); without B when all input is of one flight.
    """
    angle, velocity = angle_increment, velocity_increment
    samples = angle.shape[-2]
    at = np.array([samples]) if instants is None else np.rint(np.asarray(instants) / step_s).astype(int)
    edges = _edges(samples, at, None if height is None else HELD_S / step_s)
    alone = np.ndim(start.latitude) == 0
    c_bi, speed, position = to_inertial(part_of(start, (None,)) if alone else start)
    frame = quaternion.from_matrix(c_bi), speed.T, position.T
    moved = _reduce(angle.reshape(-1, samples, 3), velocity.reshape(-1, samples, 3), edges, step_s)
    chosen = [0, *np.searchsorted(edges, at)]
    held = None if height is None else (height[0][edges[1:]], height[1][edges[1:]])
    turned, speed, position = (x[:, chosen] for x in _chain(*frame, *moved, np.diff(edges) * step_s, held))
    position[:, 1:] -= _centroid(velocity.reshape(-1, samples, 3), turned, at, step_s)
    attitude = quaternion.to_matrix(turned[:, 1:]).swapaxes(0, 1)
    state = from_inertial(attitude, speed[:, 1:].T, position[:, 1:].T, at * step_s)
    if instants is None:
        state = part_of(state, (slice(None), 0))
    single = alone and angle.ndim == velocity.ndim == 2
    return part_of(state, (0,)) if single else state


def compensate(angle: Array, velocity: Array) -> tuple[Array, Array]:
    """Rotation vector and velocity increment, in the body frame at its start, of every interval.

    Attitude and ∫C f dt together obey Y' = Y A with A = (ω, f) in the Lie algebra of rigid motions, whose
    bracket is [(ω, f), (ω', f')] = (ω × ω', ω × f' - ω' × f). So coning and sculling are one Magnus series;
    with a₁ + a₃/12 = (α, v), a₂ and a₃ the slope and half the bend of A over the interval, to sixth order

        Ω = a₁ + a₃/12 + [20 a₁ + a₃ + c, a₂ + [a₁, 2 a₃ - c]/60]/240,  c = [a₁, a₂];   θ = Ω_ω, u = J(θ) Ω_f

    Slope and bend are taken from the two neighbours on either side, extrapolated at the ends.
    angle, velocity: (3, ..., n) increments α and v, components first, time last.
    Source: S. Blanes, F. Casas, J. A. Oteo, J. Ros, "The Magnus expansion and some of its applications",
    Physics Reports 470 (2009), the sixth-order form with three commutators.
    """
    a = np.concatenate(np.broadcast_arrays(angle, velocity))
    slope, bend = _slope_and_bend(a)
    first = a - bend / 12.0
    c = _bracket(first, slope)
    inner = slope + _bracket(first, 2.0 * bend - c) / 60.0
    series = a + _bracket(20.0 * first + bend + c, inner) / 240.0
    return series[:3], _averaged(series[:3], series[3:])


def _slope_and_bend(a: Array) -> tuple[Array, Array]:
    """First moment of a, for a cubic, and half its second difference, from increments x at -2..2.

    slope = 12/Δ ∫τ a dτ = (x₁ - x₋₁)/2 - 11/120 (x₂ - 2 x₁ + 2 x₋₁ - x₋₂);  bend = (x₁ - 2 x₀ + x₋₁)/2
    """
    if a.shape[-1] < 3:
        return np.zeros_like(a), np.zeros_like(a)
    x = np.empty((*a.shape[:-1], a.shape[-1] + 4))
    x[..., 2:-2] = a
    for i, sign in ((1, 1), (0, 1), (-2, -1), (-1, -1)):
        x[..., i] = 3.0 * (x[..., i + sign] - x[..., i + 2 * sign]) + x[..., i + 3 * sign]
    near = x[..., 3:-1] - x[..., 1:-3]
    far = x[..., 4:] - x[..., :-4]
    return (82.0 * near - 11.0 * far) / 120.0, 0.5 * (x[..., 3:-1] + x[..., 1:-3]) - a


def _bracket(a: Array, b: Array) -> Array:
    """Commutator of rigid motions (6, ...): rotation, then translation."""
    return np.concatenate([cross(a[:3], b[:3]), cross(a[:3], b[3:]) - cross(b[:3], a[3:])])


def _averaged(theta: Array, vector: Array) -> Array:
    """J(θ) v, the left Jacobian applied: v + (1 - cosθ)/θ² θ × v + (θ - sinθ)/θ³ θ × (θ × v), |θ| < 1."""
    square = np.sum(theta * theta, axis=0)
    first = 0.5 - square * (1 / 24 - square * (1 / 720 - square * (1 / 40320 - square / 3628800)))
    second = 1 / 6 - square * (1 / 120 - square * (1 / 5040 - square * (1 / 362880 - square / 39916800)))
    turned = cross(theta, vector)
    return np.asarray(vector + first * turned + second * cross(theta, turned))


def _edges(samples: int, at: Indices, most: float | None) -> Indices:
    """Blocks of √n / 2 samples, or `most`, short enough for gravitation, with edges at `at`."""
    size = max(1, round(0.5 * samples**0.5 if most is None else min(most, 0.5 * samples**0.5)))
    return np.unique(np.concatenate([np.arange(0, samples, size), at, [samples]]))


def _reduce(angle: Array, velocity: Array, edges: Indices, step_s: float) -> tuple[Array, Array, Array]:
    """Each block's rotation (4, B, b) and, in its first body frame, ∫f (3, B, b) and ∫(T-t) f (3, B, b)."""
    samples, flights = angle.shape[1], max(len(angle), len(velocity))
    most = max(1, _SLICE_SAMPLES // samples)
    parts = [
        _reduce_slice(angle[_these(angle, i, most)], velocity[_these(velocity, i, most)], edges, step_s)
        for i in range(0, flights, most)
    ]
    rotation, force, moment = (np.concatenate(part, axis=1) for part in zip(*parts, strict=True))
    return rotation, force, moment


def _these(readings: Array, first: int, most: int) -> slice:
    return slice(None) if len(readings) == 1 else slice(first, first + most)


def _reduce_slice(angle: Array, velocity: Array, edges: Indices, step_s: float) -> tuple[Array, Array, Array]:
    sizes = np.diff(edges)
    index = edges[:-1] + np.arange(sizes.max())[:, None]  # (m, b): sample s of every block, then the next
    padding = index >= edges[1:]
    index[padding] = 0
    turns, pushes = _motions(angle, velocity, index, padding)
    left = (edges[1:] - 0.5 - index) * step_s
    rotation = np.zeros((4, *turns.shape[2:]))
    rotation[0] = 1.0
    force, moment = np.zeros((2, 3, *turns.shape[2:]))
    for turn, push, remaining in zip(turns, pushes, left, strict=True):
        pushed = quaternion.rotated(rotation, push)
        force += pushed
        moment += remaining * pushed
        rotation = quaternion.product(rotation, turn)
    return rotation, force, moment


def _motions(
    angle: Array, velocity: Array, index: Indices, padding: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Turn (m, 4, B, b) and push (m, 3, B, b) of sample s of every block; padding does neither."""
    flights = max(len(angle), len(velocity))
    turns = np.empty((len(index), 4, flights, index.shape[1]))
    pushes = np.empty((len(index), 3, flights, index.shape[1]))
    few = max(1, _CACHE_SAMPLES // angle.shape[1])
    for i in range(0, flights, few):
        readings = (x[_these(x, i, few)].transpose(2, 0, 1) for x in (angle, velocity))
        theta, u = compensate(*map(np.ascontiguousarray, readings))
        turns[:, :, i : i + few] = np.moveaxis(quaternion.from_rotation_vector(theta)[:, :, index], 2, 0)
        pushes[:, :, i : i + few] = np.moveaxis(u[:, :, index], 2, 0)
    turns.transpose(0, 3, 1, 2)[padding] = np.eye(4)[:, :1]
    pushes.transpose(0, 3, 1, 2)[padding] = 0.0
    return turns, pushes


def _chain(
    rotation: Array,
    velocity: Array,
    position: Array,
    turns: Array,
    force: Array,
    moment: Array,
    duration: Array,
    held: tuple[Array, Array] | None,
) -> tuple[Array, Array, Array]:
    """Rotation b to i (4, b + 1, B), velocity and position in i (3, b + 1, B) at the edges of the blocks.

    Gravitation of a block is linear in time between its ends, the second of them predicted:
    v += X + (γ₀ + γ₁) T/2,  r += v T + Y + (γ₀/3 + γ₁/6) T².
    """
    blocks, flights = turns.shape[2], max(rotation.shape[1], turns.shape[1])
    rotations = np.empty((4, blocks + 1, flights))
    velocities, positions = np.empty((2, 3, blocks + 1, flights))
    rotations[:, 0], velocities[:, 0], positions[:, 0] = rotation, velocity, position
    for k in range(blocks):
        rotations[:, k + 1] = quaternion.product(rotations[:, k], turns[:, :, k])
    x, y = (quaternion.rotated(rotations[:, :-1], np.swapaxes(part, 1, 2)) for part in (force, moment))
    before = earth.gravitation(positions[:, 0].T).T
    for k, t in enumerate(duration):
        moved = positions[:, k] + velocities[:, k] * t + y[:, k]
        after = earth.gravitation((moved + before * (t * t / 2.0)).T).T
        positions[:, k + 1] = moved + (before / 3.0 + after / 6.0) * (t * t)
        velocities[:, k + 1] = velocities[:, k] + x[:, k] + (before + after) * (t / 2.0)
        before = after
        if held is not None:
            altitude, down = float(held[0][k]), float(held[1][k])
            positions[:, k + 1], velocities[:, k + 1] = hold(
                positions[:, k + 1], velocities[:, k + 1], altitude, down
            )
    return rotations, velocities, positions


def _centroid(velocity: Array, rotation: Array, at: Indices, step_s: float) -> Array:
    """Σ f' Δt³/12 = (f - f_start) Δt²/12 in i axes (3, k, B): the push of a sample is not in its middle."""
    samples = velocity.shape[1]
    edges = np.concatenate([[0], at])
    mean = 0.5 * (velocity[:, np.maximum(edges - 1, 0)] + velocity[:, np.minimum(edges, samples - 1)])
    force = quaternion.rotated(rotation, np.moveaxis(mean, (1, 2), (1, 0)))
    return np.asarray((force[:, 1:] - force[:, :1]) * (step_s / 12.0))


def to_inertial(state: NavigationState, time_s: Array | float = 0.0) -> tuple[Array, Array, Array]:
    """C_bi (..., 3, 3), velocity and position (..., 3) in i, time_s after i and e coincided."""
    c_ie = earth.inertial_from_ecef(time_s)
    c_in = c_ie @ earth.ecef_from_ned(state.latitude, state.longitude)
    position = rotate(c_ie, earth.lla_to_ecef(state.latitude, state.longitude, state.altitude))
    return c_in @ state.attitude, rotate(c_in, state.velocity) + _carried(position), position


def from_inertial(c_bi: Array, velocity: Array, position: Array, time_s: Array | float) -> NavigationState:
    """The inverse of `to_inertial`."""
    c_ei = np.swapaxes(earth.inertial_from_ecef(time_s), -1, -2)
    latitude, longitude, altitude = earth.ecef_to_lla(rotate(c_ei, position))
    c_ni = earth.ned_from_ecef(latitude, longitude) @ c_ei
    relative = rotate(c_ni, velocity - _carried(position))
    return NavigationState(latitude, longitude, altitude, relative, c_ni @ c_bi)


def _carried(position: Array) -> Array:
    """Ω × r, (..., 3)."""
    x, y = position[..., 0], position[..., 1]
    return EARTH_RATE_RADPS * np.stack([-y, x, np.zeros_like(x)], axis=-1)


def part_of(state: NavigationState, index: tuple[slice | int | Sequence[int] | None, ...]) -> NavigationState:
    """Some of the states, as NumPy takes an index."""
    fields = (state.latitude, state.longitude, state.altitude, state.velocity, state.attitude)
    return NavigationState(*(np.asarray(x)[index] for x in fields))
