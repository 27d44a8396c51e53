"""A flight cut into blocks of about a second, and what sensor errors leave at the end of each block.

Everything is in the inertial frame i (the e frame at time zero), where attitude is a pure integral and the
specific force does not depend on position, so that nothing of this needs a loop over samples. Both the
linear error equations and the nonlinear simulation of small errors stand on it.

Matrices are component-first here, (3, 3, n), so that every line is one vectorised pass over all samples.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from planner.physics.earth import EARTH_RATE_RADPS, Array

Indices = NDArray[np.int64]
Forcing = Callable[[int, int], tuple[Sequence[Array], Sequence[Array]]]
"""(start, stop) of samples -> errors of the gyros (rad/s) and of the accelerometers (m/s²), each as arrays
(n, 3, k) whose columns follow one another: mean over each sample, in body axes."""
Active = Callable[[int, int], Indices]
"""(start, stop) of samples -> which of all columns the forcing gives there, gyro columns first."""

_FAST_TURN_RAD = 1e-2  # in one sample; below it what the turn inside the sample adds is under 1e-5
_CHUNK_SAMPLES = 4_000  # bounds the memory, 2 MB per ten columns; fewer or more cost speed


class Motion(Protocol):
    """A flight on a uniform grid of n + 1 instants; `planner.nouns.Trajectory` is one. Units as there."""

    @property
    def time_s(self) -> Array:
        """(n + 1,)."""

    @property
    def latitude(self) -> Array:
        """(n + 1,) rad."""

    @property
    def longitude(self) -> Array:
        """(n + 1,) rad."""

    @property
    def altitude(self) -> Array:
        """(n + 1,) m."""

    @property
    def velocity(self) -> Array:
        """(n + 1, 3) north, east, down, m/s."""

    @property
    def attitude(self) -> Array:
        """(n + 1, 3, 3) C_nb."""

    @property
    def angle_increment(self) -> Array:
        """(n, 3) rad."""

    @property
    def velocity_increment(self) -> Array:
        """(n, 3) m/s."""

    @property
    def height_aid_m(self) -> float | None:
        """One sigma of what holds the computed height; None: nothing does."""


@dataclass(frozen=True)
class Blocks:
    """A flight of b blocks. ROTATION, VELOCITY, POSITION are the rows of a response.

    edges: (b + 1,) samples at which blocks begin and end; duration: (b,) s
    force: (b, 3) X = ∫f dt in m/s; force_moment: (b, 3) Y = ∫(T-t) f dt in m, both in inertial axes
    response: (b, 9, p) attitude (rad), velocity and position error in inertial axes at the block's end per
        unit of each column, from zero at its start; gyro columns first, then accelerometers
    """

    edges: Indices
    duration: Array
    force: Array
    force_moment: Array
    response: Array


ROTATION, VELOCITY, POSITION = slice(0, 3), slice(3, 6), slice(6, 9)


def cut_into_blocks(motion: Motion, forcing: Forcing, block_s: float, instants: Sequence[float]) -> Blocks:
    """Blocks of at most block_s and at most a 60th of the flight, edges at the samples nearest to instants.

    The forcing is asked for successive stretches of samples, so that two hours at 100 Hz need little memory.
    """
    edges = block_edges(motion.time_s, block_s, instants)
    parts = list(pieces(motion, forcing, edges))
    return Blocks(
        edges=edges,
        duration=np.diff(motion.time_s[edges]),
        force=np.concatenate([part.force for part in parts]),
        force_moment=np.concatenate([part.force_moment for part in parts]),
        response=np.concatenate([part.response for part in parts]),
    )


def pieces(motion: Motion, forcing: Forcing, edges: Indices) -> Iterator[Blocks]:
    """The blocks between edges (b + 1,), some thousand samples at a time: a flight of any length fits."""
    for starts, size in _chunks(edges):
        force, moment, response = _responses(motion, forcing, starts, size)
        own = np.append(starts, starts[-1] + size)
        yield Blocks(own, np.diff(motion.time_s[own]), force, moment, response)


def block_edges(time_s: Array, block_s: float, instants: Sequence[float]) -> Indices:
    """Samples at which blocks begin and end."""
    samples = len(time_s) - 1
    step = (time_s[-1] - time_s[0]) / samples
    size = max(1, round(min(block_s, samples * step / 60.0) / step))
    wanted = np.clip(np.rint((np.asarray(instants, dtype=float) - time_s[0]) / step), 0, samples)
    return np.unique(np.concatenate([np.arange(0, samples, size), wanted.astype(int), [samples]]))


def _chunks(edges: Indices) -> Iterator[tuple[Indices, int]]:
    """Runs of blocks of one size: their first samples, and the size."""
    sizes = np.diff(edges)
    for run in np.split(np.arange(len(sizes)), np.flatnonzero(np.diff(sizes)) + 1):
        size = int(sizes[run[0]])
        most = max(1, _CHUNK_SAMPLES // size)
        for i in range(0, len(run), most):
            yield edges[run[i : i + most]], size


def _responses(motion: Motion, forcing: Forcing, starts: Indices, size: int) -> tuple[Array, Array, Array]:
    """X (B, 3), Y (B, 3) and response (B, 9, p + q) of B adjoining blocks of `size` samples.

    An error u(t) of a sensor, in the body, leaves at the end of its block

        gyro            attitude ∫C u dt    velocity -∫[X×]C u dt    position -∫[Y×]C u dt
        accelerometer                       velocity ∫C u dt         position ∫(T - t) C u dt

    with X(t) = ∫f and Y(t) = ∫(T-τ) f dτ from t to the end of the block. Over a sample of length Δt, with
    means D of C, ū of u, f̄ of f, change E = C₁ - C₀, and Δ from the sample before to the one after,

        ∫C u dt = (D ū + E Δu/24) Δt,      v = ∫C f dt = (D f̄ + E Δf/24) Δt
        ∫[X×]C u dt = {[(X_mean + E v^b/12)×] (D ū + E Δu/24) - [v×] (E ū/12 + D Δu/24)} Δt

    to the third power of the angle turned; Y has (T - t) v for v. The sums over the samples are matrix
    products of the weights 1, X, Y, v with the columns. Where no sample turns far, E and Δ are left out.
    """
    s = _turning(motion, int(starts[0]), int(starts[-1]) + size)
    gyro, accelerometer = (_Columns(list(parts)) for parts in forcing(int(starts[0]), int(starts[-1]) + size))
    shape = (3, len(starts), size)
    left = (size - 0.5 - np.arange(size)) * s.step
    v = s.push.reshape(shape)
    v_left = left * v
    tail_v, tail_r = _tail(v), _tail(v_left)
    x, y = tail_v - 0.5 * v, tail_r - 0.5 * v_left
    if s.curvature is not None:
        x += s.curvature.reshape(shape)
        y += left * s.curvature.reshape(shape)
    whole = np.ones((1, *shape[1:]))

    turned = gyro.summed(s.mean, s.change, np.concatenate([whole, x, y]))
    moved = -turned[:, 1:]
    if s.change is not None:
        moved += gyro.summed(s.change / 12.0, s.mean, np.concatenate([v, v_left]))
    pushed = accelerometer.summed(
        s.mean, s.change, np.concatenate([whole, np.broadcast_to(left, whole.shape)])
    )
    return tail_v[..., 0].T, tail_r[..., 0].T, s.step * _stacked(turned[:, 0], moved, pushed)


def _stacked(turned: Array, moved: Array, pushed: Array) -> Array:
    """Gyro sums (B, 3, p), products of X and Y with columns (B, 6, 3, p), accelerometer sums (B, 2, 3, q)."""
    blocks, _, p = turned.shape
    response = np.zeros((blocks, 9, p + pushed.shape[3]))
    response[:, ROTATION, :p] = turned
    response[:, VELOCITY, :p] = _antisymmetric(moved[:, :3])
    response[:, POSITION, :p] = _antisymmetric(moved[:, 3:])
    response[:, VELOCITY, p:] = pushed[:, 0]
    response[:, POSITION, p:] = pushed[:, 1]
    return response


@dataclass(frozen=True)
class _Turning:
    """A stretch of n samples: D and E (3, 3, n), v and E v^b/12 (3, n); None where all turn little."""

    step: float
    mean: Array
    change: Array | None
    push: Array
    curvature: Array | None


def _turning(motion: Motion, first: int, last: int) -> _Turning:
    step = float((motion.time_s[last] - motion.time_s[first]) / (last - first))
    angle = np.ascontiguousarray(motion.angle_increment[first:last].T)
    increment = np.ascontiguousarray(motion.velocity_increment[first:last].T)
    c = _body_to_inertial(motion, first, last)
    if np.abs(angle).max() <= _FAST_TURN_RAD:
        mean = _sample_mean(c, None, angle)
        return _Turning(step, mean, None, _times(mean, increment), None)
    change = c[..., 1:] - c[..., :-1]
    mean = _sample_mean(c, change, angle)
    push = _times(mean, increment) + _times(change, _slope(increment))
    return _Turning(step, mean, change, push, _times(change, increment) / 12.0)


class _Columns:
    """The forcing of one sensor, column by column, as series of single channels: most columns act on one."""

    def __init__(self, parts: Sequence[Array]) -> None:
        self.columns: list[list[tuple[int, Array]]] = []
        for part in parts:
            by_channel = np.ascontiguousarray(part.transpose(2, 1, 0))
            self.columns += [
                [(channel, values) for channel, values in enumerate(column) if values.any()]
                for column in by_channel
            ]

    @property
    def count(self) -> int:
        return len(self.columns)

    def summed(self, of_value: Array, of_change: Array | None, weights: Array) -> Array:
        """Σ over the samples of each block of weight · (of_value u + of_change Δu/24): (B, w, 3, count).

        of_value, of_change: (3, 3, n) per sample; weights: (w, B, m), n = B m
        """
        vectors = np.empty((self.count, 3, of_value.shape[2]))
        for vector, series in zip(vectors, self.columns, strict=True):
            (channel, values), *others = series or [(0, np.zeros(1))]
            np.multiply(of_value[:, channel], values, out=vector)
            for other, more in others:
                vector += of_value[:, other] * more
            if of_change is not None:
                _add_changes(vector, of_change, series)
        w, blocks, size = weights.shape
        columns = vectors.reshape(3 * self.count, blocks, size).transpose(1, 2, 0)
        sums = weights.transpose(1, 0, 2) @ columns
        return np.asarray(sums.reshape(blocks, w, self.count, 3).swapaxes(2, 3))


def _add_changes(vector: Array, of_change: Array, series: Sequence[tuple[int, Array]]) -> None:
    for channel, values in series:
        if (values != values[0]).any():
            vector += of_change[:, channel] * _slope(values)


def _slope(values: Array) -> Array:
    """(x_next - x_previous)/24 along the last axis; at the ends from the only neighbour."""
    result = np.zeros_like(values)
    if values.shape[-1] > 1:
        result[..., 1:-1] = values[..., 2:] - values[..., :-2]
        result[..., 0] = 2.0 * (values[..., 1] - values[..., 0])
        result[..., -1] = 2.0 * (values[..., -1] - values[..., -2])
    return result / 24.0


def _antisymmetric(products: Array) -> Array:
    """x × e from the products x_a e_b: (B, 3, 3, p) -> (B, 3, p)."""
    pairs = ((1, 2), (2, 0), (0, 1))
    return np.stack([products[:, j, k] - products[:, k, j] for j, k in pairs], axis=1)


def _body_to_inertial(motion: Motion, first: int, last: int) -> Array:
    """C_bi (3, 3, n + 1) at the instants first..last: C_nb turned by latitude, then by longitude + Ω t."""
    part = slice(first, last + 1)
    c = np.ascontiguousarray(motion.attitude[part].transpose(1, 2, 0))
    angle = motion.longitude[part] + EARTH_RATE_RADPS * (motion.time_s[part] - motion.time_s[0])
    sin_phi, cos_phi = np.sin(motion.latitude[part]), np.cos(motion.latitude[part])
    sin, cos = np.sin(angle), np.cos(angle)
    outward = -sin_phi * c[0] - cos_phi * c[2]
    result = np.empty_like(c)
    np.subtract(cos * outward, sin * c[1], out=result[0])
    np.add(sin * outward, cos * c[1], out=result[1])
    np.subtract(cos_phi * c[0], sin_phi * c[2], out=result[2])
    return result


def _sample_mean(c: Array, change: Array | None, angle: Array) -> Array:
    """Mean of C over each sample, (3, 3, n), by the trapezoid with end correction where the body turns fast.

    mean = (C₀ + C₁)/2 - (C₁ - C₀)[θ×]/12 - C[Δθ×]/24, since C' = C[ω×]; error θ⁴/720, without change θ²/12.
    """
    mean = c[..., :-1] + c[..., 1:]
    mean *= 0.5
    if change is not None:
        _subtract_cross_rows(mean, change, angle / 12.0)
        _subtract_cross_rows(mean, c[..., :-1], _slope(angle))
    return mean


def _subtract_cross_rows(target: Array, matrix: Array, vector: Array) -> None:
    """Target - M [v×], in place; (3, 3, n) and (3, n)."""
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        target[:, i] -= matrix[:, j] * vector[k]
        target[:, i] += matrix[:, k] * vector[j]


def _times(matrix: Array, vector: Array) -> Array:
    """(3, 3, ...) · (3, ...) -> (3, ...)."""
    return np.asarray(matrix[:, 0] * vector[0] + matrix[:, 1] * vector[1] + matrix[:, 2] * vector[2])


def _tail(values: Array) -> Array:
    """Sums from each sample to the end of its block, itself included."""
    return np.cumsum(values[..., ::-1], axis=-1)[..., ::-1]
