"""Whether what becomes another one at a power-on is how the unit stands: one rotation of all its channels.

    y_i = (1 + κ_i) u_i + m_ij u_j + (θ × u)_i [run > place] + b_run

Another unit has twelve leans and six scale factors of its own. The same one, turned in its fixture by θ,
shares three angles between them; what all coefficients would explain, free on either side of the place,

    Δ = Σ_i (R_i − R_i,split) / s_i²,   s_i² = R_i,split / freedom

is then what θ explains, but for a share: scale factors and leans of a unit are drawn anew at every power-on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.orthogonal import about_means, clear, orthonormal
from planner.nouns.array import Array

OTHERWISE = 0.1  # of Δ that the angles may leave: of another unit's leans they leave three quarters


def mounted_anew(
    sensors: Sequence[tuple[Array, Array]], weights: Array, run: NDArray[np.int64], place: int
) -> bool:
    """Whether a common rotation behind a power-on (`place`) says what every coefficient by itself does.

    sensors: reading and reference (n, 3) of each; weights: (n, nodes) of scale factors over temperature
    """
    later = (run > place)[:, None]
    gram, h, whole = np.zeros((3, 3)), np.zeros(3), 0.0
    for own, target, turns in _channels(sensors, weights, run, later):
        halves = np.column_stack([np.where(later, own, 0.0), np.where(later, 0.0, own)])
        split = clear(orthonormal(halves, 1e-6), target)
        freedom = max(len(target) - int(run.max()) - halves.shape[1], 1)
        s2 = max(float(split @ split) / freedom, 1e-30)
        basis = orthonormal(own, 1e-6)
        z, W = clear(basis, target), clear(basis, turns)
        gram, h = gram + W.T @ W / s2, h + W.T @ z / s2
        whole += float(z @ z - split @ split) / s2
    by_angles = float(h @ np.linalg.pinv(gram, rcond=1e-9, hermitian=True) @ h)
    return whole - by_angles <= OTHERWISE * whole


def _channels(
    sensors: Sequence[tuple[Array, Array]], weights: Array, run: NDArray[np.int64], later: NDArray[np.bool_]
) -> Iterator[tuple[Array, Array, Array]]:
    """Of each channel, about the means of power-ons: (n, k) its own columns, (n,) y − u, (n, 3) e_j × u."""
    for y, u in sensors:
        turned = np.stack([np.cross(e, u) for e in np.eye(3)], axis=2) * later[:, :, None]
        for axis in range(3):
            own = np.column_stack([np.delete(u, axis, axis=1), weights * u[:, [axis]]])
            every = np.column_stack([own, y[:, axis] - u[:, axis], turned[:, axis]])
            about = about_means(every, run)
            yield about[:, :-4], about[:, -4], about[:, -3:]
