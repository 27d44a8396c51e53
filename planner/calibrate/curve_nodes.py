"""What a fit tells of curves over temperature: each channel's nodes and how large its curve is.

    v = c + f(T_k) + e,   E f fᵀ = κ M,   cov e = C

M is the mean of the second moments of the families that leave the spec's table of residuals; κ says how much
larger the squares of these curves are than that table has them. It is found in the contrasts of v, in which
the constant c is not (REML: Patterson, Thompson, Biometrika 58 (1971) 545):

    Lᵀv ~ (0, κ LᵀML + LᵀCL),   Lᵀ1 = 0
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.campaign.estimate import Estimate
from planner.nouns.array import Array
from planner.protocols import Sensor

Error = tuple[Sensor, str]
SIZES = np.geomspace(1e-4, 1e4, 1601)  # of κ: a curve a hundredth to a hundred times as large as it should be
WITHIN = 1.92  # by which the log-likelihood falls at the ends of a 95 % interval
PRIOR = float(np.log(4.0))  # sigma of ln κ: a curve is hardly ever four times as large as its table has it


@dataclass(frozen=True)
class CurveNodes:
    """One channel's table. degc, values, freedom: (K,); noise: (K, K); freedom: of each node's estimate."""

    error: Error
    channel: int
    term: str
    degc: Array
    values: Array
    noise: Array
    freedom: Array


@dataclass(frozen=True)
class Size:
    """κ and its 95 % interval; most: by likelihood alone, value: with what the spec's table says of it."""

    value: float
    most: float
    low: float
    high: float


def curve_nodes(fits: Sequence[Estimate]) -> list[CurveNodes]:
    """Every table of the fits with the nodes that the data determine."""
    found = []
    for fit in fits:
        columns = fit.model.columns()
        for carried in fit.model.carried:
            name = carried.effect.name
            mine = [
                i
                for i, c in enumerate(columns)
                if c.effect == name and not c.parameter and not fit.fit.undetermined[i]
            ]
            if carried.nodes is None or len(carried.terms) != 1 or not mine:
                continue
            found.append(
                CurveNodes(
                    (fit.model.sensor, name),
                    fit.model.channel,
                    columns[mine[0]].term,
                    np.array([columns[i].node_degc for i in mine]),
                    fit.theta[mine],
                    fit.fit.covariance[np.ix_(mine, mine)],
                    fit.fit.freedom[mine],
                )
            )
    return found


def contrasts(n: int) -> Array:
    """(n, n − 1) orthonormal columns across the constant."""
    return np.asarray(np.linalg.qr(np.column_stack([np.ones(n), np.eye(n)[:, 1:]]))[0][:, 1:])


def size_of(channels: Sequence[CurveNodes], moments: Sequence[Array]) -> Size:
    """κ of one error from all its channels; moments: (K, K) M at each one's nodes."""
    minus = np.zeros(len(SIZES))
    for c, M in zip(channels, moments, strict=True):
        if len(c.degc) < 2:  # one node is a constant
            continue
        L = contrasts(len(c.degc))
        root = np.linalg.cholesky(L.T @ c.noise @ L + _LEAST * np.trace(M) * np.eye(L.shape[1]))
        white = np.linalg.solve(root, L.T)
        values, vectors = np.linalg.eigh(white @ M @ white.T)
        u = vectors.T @ (white @ c.values)
        spread = 1.0 + SIZES[:, None] * np.maximum(values, 0.0)
        minus += 0.5 * np.sum(np.log(spread) + u**2 / spread, axis=1)
    near = SIZES[minus <= minus.min() + WITHIN]
    drawn = minus + 0.5 * (np.log(SIZES) / PRIOR) ** 2
    return Size(
        float(SIZES[drawn.argmin()]), float(SIZES[minus.argmin()]), float(near.min()), float(near.max())
    )


_LEAST = 1e-12  # of a curve's own variance: estimates without any noise must not make V singular
