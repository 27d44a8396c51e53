"""Columns without which the noise would be judged too large: what has no name and hides in it.

Where all candidates together are too many for the rows, those without a name stay out of the model under
which the noise is judged. One of them that is there then counts as noise: a scale factor that steps between
two days is a large spread of it from power-on to power-on, beside which nothing is significant. So they are
asked one by one what the likelihood says of them with the variances that they leave,

    2 (log L_b − log L) − m log n > DECISIVE,   log L = −½ (log|V| + yᵀPy), V by REML of each model

the strongest goes in, and the others are asked again beside it. It must predict half of what it explains in
power-ons that its fit has not seen, and nothing strong must have a name: a coefficient of a thousand sigma
that scatters by a hundredth looks like any bins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.diagnose.hypotheses.lack_of_fit import DECISIVE
from planner.diagnose.hypotheses.noise import TOLD, Readings, Weighed, weighed
from planner.diagnose.hypotheses.orthogonal import clear, orthonormal
from planner.diagnose.hypotheses.pool import inverse
from planner.diagnose.hypotheses.verdicts import OF_A_TABLE, predicted
from planner.nouns.array import Array
from planner.solvers.least_squares import factors

STRONG = 30.0  # sigma explained by what has a name: how it misses looks like anything, and hides nothing
MOST = 3  # blocks on one channel; what more would explain is a channel that follows nothing


def with_what_hides(readings: Readings, unnamed: Sequence[Array]) -> Readings:
    """The readings with those unnamed blocks (n, k) among their candidates that the likelihood asks for."""
    left = list(unnamed)
    for _ in range(MOST):
        plain = weighed(readings) if left else None
        if plain is None or _explained(plain) > STRONG**2:
            break
        gains = [_gain(plain, plain.beside(block)) for block in left]
        best = int(np.argmax(gains))
        if gains[best] <= DECISIVE:
            break
        readings = replace(readings, candidates=np.column_stack([readings.candidates, left.pop(best)]))
    return readings


def _explained(plain: Weighed) -> float:
    """Squares of sigma that the model explains."""
    X, y = plain.white()
    return float(np.sum((factors(X, TOLD).basis.T @ y) ** 2))


def _gain(plain: Weighed, more: Weighed | None) -> float:
    if more is None:
        return -np.inf
    cost = (more.columns - plain.columns) * float(np.log(plain.rows))
    gain = 2.0 * (more.loglik - plain.loglik) - cost
    return gain if gain <= DECISIVE or _predicts(more, plain.columns) else -np.inf


def _predicts(more: Weighed, columns: int) -> bool:
    """Whether the last columns of a model, after so many, predict power-ons that their fit has not seen."""
    X, y = more.white()
    Q = orthonormal(X[:, :columns])
    C, z = clear(Q, X[:, columns:]), clear(Q, y[:, None])[:, 0]
    gram = np.add.reduceat(C[:, :, None] * C[:, None, :], more.starts)
    h = np.add.reduceat(C * z[:, None], more.starts)
    H = h.sum(axis=0)
    explained = float(H @ inverse(gram.sum(axis=0)) @ H)
    return predicted(gram, h) > OF_A_TABLE * explained
