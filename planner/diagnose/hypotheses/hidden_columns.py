"""Columns without which the noise would be judged too large: what hides in it.

Where all candidates together are too many for the rows, those without a name stay out of the model under
which the noise is judged; where the others are too many still, or power-ons are few, all of them. One that is
there then counts as noise: a scale factor that steps between two days is a large spread of it from power-on
to power-on, beside which nothing is significant. So they are asked one by one what the likelihood says of
them with the variances that they leave,

    2 (log L_b − log L) − m log n > DECISIVE,   log L = −½ (log|V| + yᵀPy), V by REML of each model

the strongest goes in, and the others are asked again beside it. One without a name must predict half of what
it explains in power-ons that its fit has not seen, and nothing strong must have a name: a coefficient of a
thousand sigma that scatters by a hundredth looks like any bins.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE
from planner.diagnose.hypotheses.noise import TOLD, Readings, inverse_of
from planner.diagnose.hypotheses.orthogonal import clear, orthonormal
from planner.diagnose.hypotheses.pool import inverse
from planner.diagnose.hypotheses.verdicts import OF_A_TABLE, predicted
from planner.diagnose.hypotheses.weighed_columns import Weighed, weighed
from planner.diagnose.hypotheses.whitened import log_p
from planner.nouns.array import Array
from planner.solvers.least_squares import factors
from planner.solvers.random_effects import woodbury
from planner.solvers.restricted_likelihood import Sample, reml_information

STRONG = 30.0  # sigma explained by what has a name: how it misses looks like anything, and hides nothing
FEW = 8  # blocks whose likelihood is asked: those that promise most
MOST = 3  # blocks without a name on one channel, and as many with: more is a channel that follows nothing


def with_what_hides(readings: Readings, hidden: Sequence[Block]) -> Readings:
    """The readings with those blocks among their candidates that the likelihood asks for."""
    axis, taken = readings.channel.axis, Counter[bool]()
    left = dict(enumerate(hidden))
    while left:
        plain = weighed(readings)
        if plain is None:
            break
        strong = _explained(plain, readings) > STRONG**2
        asked = [k for k, b in left.items() if taken[b.generic] < MOST and not (b.generic and strong)]
        columns = {k: left[k].columns[axis] for k in _promising(plain, left, asked, axis)}
        gains = {k: _gain(plain, x, left[k].generic) for k, x in columns.items()}
        best = max(gains, key=lambda k: gains[k], default=-1)
        if best < 0 or gains[best] <= DECISIVE:
            break
        taken[left[best].generic] += 1
        readings = replace(readings, candidates=np.column_stack([readings.candidates, columns[best]]))
        gone = left[best].key
        left = {k: b for k, b in left.items() if b.key != gone}
    return readings


def _promising(plain: Weighed, left: Mapping[int, Block], asked: Sequence[int], axis: int) -> list[int]:
    """Of the blocks asked for those that may gain most by either law of the noise."""
    if len(asked) <= FEW:
        return list(asked)
    promises = plain.promises([left[k].columns[axis] for k in asked])
    first = {int(i) for law in promises for i in np.argsort(-law)[:FEW]}
    return [asked[i] for i in sorted(first)]


def _explained(plain: Weighed, readings: Readings) -> float:
    """Squares of sigma that the candidates in the model explain beside what is declared."""
    X, y = plain.white()
    basis = factors(plain.whitened(readings.declared), TOLD).basis
    more = factors(clear(basis, X), TOLD).basis
    return float(np.sum((more.T @ clear(basis, y[:, None])[:, 0]) ** 2))


def _gain(plain: Weighed, block: Array, unnamed: bool) -> float:
    more = plain.beside(block)
    if more is None:
        return -np.inf
    cost = (more.columns - plain.columns) * float(np.log(plain.rows))
    ratio = 2.0 * (more.loglik - plain.loglik)
    if ratio - cost <= DECISIVE:
        return ratio - cost
    sure = _tell_it(more, plain.columns)
    return ratio - cost if sure and (not unnamed or _predicts(more, plain.columns)) else -np.inf


def _tell_it(more: Weighed, columns: int) -> bool:
    """Whether the spread of power-ons beside the last columns of a model, after so many, is known well.

    C (n, m) those columns, whitened and orthonormal beside the others, z the readings so, Δ = |Cᵀz|²:

        p of F = Δ / m  with m and ν degrees  ≤  exp(−DECISIVE / 2) / √n,    w = Wᵀ C Cᵀz / |Cᵀz|,  wᵀVw = 1
        ν = 2 / gᵀ cov(θ) g,  g_k = wᵀV_k w     (Satterthwaite, Biometrics 2, 1946, 110)

    over the variances θ_k between power-ons, each as large as it may be, one sigma more than it comes out: C
    then keeps to what changes within them as far as it can. What lies between is judged by their spread, and
    with few of them left beside the model any columns take all of it, however large that makes the ratio.
    """
    sample, theta, a = more.judged.sample, more.theta.copy(), len(more.judged.sample.effects.diagonals)
    theta[a:] += np.sqrt(np.maximum(np.diag(_error(sample, theta, a)), 0.0))
    v = woodbury(sample.effects, theta)
    both = v.whiten(np.column_stack([sample.basis, sample.y]))
    Q = orthonormal(both[:, :columns])
    C, z = orthonormal(clear(Q, both[:, columns:-1])), clear(Q, both[:, -1:])
    h = C.T @ z
    delta = float(np.sum(h**2))
    g = v.within(v.whiten_transposed(C @ h / max(float(np.sqrt(delta)), 1e-300)))[a:]
    freedom = 2.0 / max(float(g @ _error(sample, theta, a) @ g), 1e-6)
    return bool(log_p(delta, C.shape[1], freedom, 1.0) <= -0.5 * (DECISIVE + np.log(more.rows)))


def _error(sample: Sample, theta: Array, first: int) -> Array:
    """Covariance of what the rows tell of the variances from the first one on, the others as if known."""
    return inverse_of(reml_information(sample, theta)[first:, first:])


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
