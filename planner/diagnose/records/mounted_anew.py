"""Whether what becomes another one at a power-on is of the bench: a rotation of all channels, gains of three.

    y_i = (1 + κ_i) u_i + m_ij u_j + (θ × u)_i [run > place] + b_run

Another unit has twelve leans and six scale factors of its own. The same one, turned in its fixture by θ,
shares three angles between them; what all coefficients would explain, free on either side of the place,

    Δ = Σ_i (R_i − R_i,split) / s_i²,   s_i² = R_i,split / freedom

is then what θ explains, but for a share: scale factors and leans of a unit are drawn anew at every power-on.
A table that turns faster from there on, or gravity that is another one, is one gain of each sensor, and leans
grow with it: 2.4e-3 of a lean of 0.3 deg is 0.006 deg/s at 400 deg/s, ten sigma of a turn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import about_means, clear, orthonormal
from planner.nouns.array import Array

OTHERWISE = 0.1  # of Δ that few coefficients may leave: of another unit's leans angles leave three quarters


def mounted_anew(
    sensors: Sequence[tuple[Array, Array]], weights: Array, run: NDArray[np.int64], place: int
) -> bool:
    """Whether a common rotation behind a power-on (`place`) says what every coefficient by itself does.

    sensors: reading and reference (n, 3) of each; weights: (n, nodes) of scale factors over temperature
    """
    return _common(_channels(sensors, weights, run, place, _turned), run, place)


def scaled_anew(
    sensors: Sequence[tuple[Array, Array]], weights: Array, run: NDArray[np.int64], place: int
) -> bool:
    """The same of one gain of each sensor's input."""
    return _common(_channels(sensors, weights, run, place, _scaled), run, place)


def _turned(y: Array, u: Array, axis: int, sensor: int) -> Array:
    """(n, 3) e_j × u."""
    return np.asarray(np.stack([np.cross(e, u) for e in np.eye(3)], axis=2)[:, axis])


def _scaled(y: Array, u: Array, axis: int, sensor: int) -> Array:
    """(n, 2) the reading, leans and all, in the column of its sensor."""
    return np.asarray(y[:, [axis]] * np.eye(2)[sensor])


def _common(channels: Iterable[tuple[Array, Array, Array]], run: NDArray[np.int64], place: int) -> bool:
    """Whether a few coefficients that all channels share leave little of what all by themselves explain."""
    later, gram, h, whole = (run > place)[:, None], np.zeros(1), np.zeros(1), 0.0
    for own, target, shared in channels:
        halves = np.column_stack([np.where(later, own, 0.0), np.where(later, 0.0, own)])
        split = clear(orthonormal(halves, 1e-6), target)
        freedom = max(len(target) - int(run.max()) - halves.shape[1], 1)
        s2 = max(float(split @ split) / freedom, 1e-30)
        basis = orthonormal(own, 1e-6)
        z, W = clear(basis, target), clear(basis, shared)
        gram, h = gram + W.T @ W / s2, h + W.T @ z / s2
        whole += float(z @ z - split @ split) / s2
    by_few = float(h @ np.linalg.pinv(gram, rcond=1e-9, hermitian=True) @ h)
    return whole - by_few <= OTHERWISE * whole


def _channels(
    sensors: Sequence[tuple[Array, Array]],
    weights: Array,
    run: NDArray[np.int64],
    place: int,
    felt: Callable[[Array, Array, int, int], Array],
) -> Iterator[tuple[Array, Array, Array]]:
    """Of each channel, about the means of power-ons: (n, k) its columns, (n,) y − u, (n, m) shared ones."""
    later = (run > place)[:, None]
    for sensor, (y, u) in enumerate(sensors):
        for axis in range(3):
            own = np.column_stack([np.delete(u, axis, axis=1), weights * u[:, [axis]]])
            shared = felt(y, u, axis, sensor) * later
            about = about_means(np.column_stack([own, y[:, axis] - u[:, axis], shared]), run)
            k = own.shape[1]
            yield about[:, :k], about[:, k], about[:, k + 1 :]
