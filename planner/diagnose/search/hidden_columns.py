"""Columns without which the noise would be judged too large: what hides in it.

Where all candidates together are too many for the rows, those without a name stay out of the model under
which the noise is judged; where the others are too many still, or power-ons are few, all of them. One that is
there then counts as noise: a scale factor that steps between two days is a large spread of it from power-on
to power-on, beside which nothing is significant. So they are asked one by one what the likelihood says of
them with the variances that they leave,

    2 (log L_b − log L) − m log n > DECISIVE,   log L = −½ (log|V| + yᵀPy), V by REML of each model

n the rows, or the power-ons of what differs between these alone (`Weighed.told_by`),
the strongest goes in, and the others are asked again beside it. Where each of k coefficients may be the only
one there, each is asked alone too, 2 log k dearer. One without a name must predict half of what
it explains in power-ons that its fit has not seen, and nothing strong must have a name: a coefficient of a
thousand sigma that scatters by a hundredth looks like any bins.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE
from planner.diagnose.hypotheses.pool import inverse
from planner.diagnose.noise.channel_noise import Readings, inverse_of
from planner.diagnose.noise.spread_law import spread_law
from planner.diagnose.noise.stated_spreads import KNOWN, by_both, stated_variances
from planner.diagnose.noise.weighed_columns import Weighed, weighed
from planner.diagnose.noise.whitened import log_p
from planner.diagnose.vetoes.verdicts import OF_A_TABLE, predicted
from planner.nouns.array import Array
from planner.solvers.random_effects import covariance
from planner.solvers.restricted_likelihood import Sample, reml_information
from planner.spec.budget import ErrorBudget

STRONG = 30.0  # sigma explained by what has a name: how it misses looks like anything, and hides nothing
FEW = 8  # blocks whose likelihood is asked: those that promise most
NONE: Mapping[str, ErrorBudget] = {}
MOST = 3  # blocks without a name on one channel, and as many with: more is a channel that follows nothing


@dataclass(frozen=True)
class _Asked:
    """What may hide. columns: (n, m) of a block, or one of its k; looks: log k then, of which it is one"""

    block: Block
    columns: Array
    looks: float = 0.0


def with_what_hides(
    readings: Readings, hidden: Sequence[Block], budgets: Mapping[str, ErrorBudget] = NONE
) -> tuple[Readings, Weighed | None]:
    """The readings with those blocks among their candidates that the likelihood asks for, and how they weigh.

    None where the rows tell no variance. budgets: what the spec says of the sensor's spreads
    """
    stated = stated_variances(readings.judged.components, budgets)
    taken = Counter[bool]()
    left = [asked for b in hidden for asked in _of(b, b.columns[readings.channel.axis])]
    while (plain := weighed(readings)) is not None:
        strong = plain.explained(readings.declared) > STRONG**2
        asked = [a for a in left if taken[a.block.generic] < MOST and not (a.block.generic and strong)]
        best = _best(plain, _promising(plain, asked), stated)
        if best is None:
            break
        taken[best.block.generic] += 1
        readings = replace(readings, blocks=(*readings.blocks, best.columns))
        left = [a for a in left if a is not best and (best.looks or a.block.key != best.block.key)]
    return readings, plain


def _of(block: Block, columns: Array) -> list[_Asked]:
    """A block, and each of its columns where every coefficient may be the only one that is there."""
    k = columns.shape[1]
    single = range(k) if block.apart and k > 1 else ()
    return [_Asked(block, columns), *(_Asked(block, columns[:, [j]], float(np.log(k))) for j in single)]


def _promising(plain: Weighed, asked: Sequence[_Asked]) -> list[_Asked]:
    """Of what is asked for that which may gain most, or anything, by either law of the noise."""
    if not asked:
        return []
    promises = plain.promises([a.columns for a in asked]) - 2.0 * np.array([a.looks for a in asked])
    first = {int(i) for law in promises for i in np.argsort(-law)[:FEW] if law[i] > 0.0}
    return [asked[i] for i in sorted(first)]


def _best(plain: Weighed, asked: Sequence[_Asked], stated: Mapping[int, float]) -> _Asked | None:
    """What gains most of that which is sure; None where nothing gains enough."""
    found = [(a, more) for a in asked if (more := plain.beside(a.columns)) is not None]
    gains = [_gain(plain, a, more) for a, more in found]
    for i in sorted(range(len(found)), key=lambda i: -gains[i]):
        a, more = found[i]
        if gains[i] <= DECISIVE:
            break
        sure = _tell_it(more, plain.columns, stated)
        if sure and (not a.block.generic or _predicts(more, plain.columns)):
            return a
    return None


def _gain(plain: Weighed, asked: _Asked, more: Weighed) -> float:
    """2 (log L_b − log L) − m log n, and what the looks cost."""
    cost = (more.columns - plain.columns) * plain.told_by(asked.columns) + 2.0 * asked.looks
    return 2.0 * (more.loglik - plain.loglik) - cost


def _tell_it(more: Weighed, columns: int, stated: Mapping[int, float]) -> bool:
    """Whether the spread of power-ons beside the last columns of a model, after so many, is known well.

    C (n, m) those columns, whitened and orthonormal beside the others, z the readings so, Δ = |Cᵀz|²:

        p of F = Δ / m  with m and ν degrees  ≤  exp(−DECISIVE / 2) / √n,    w = Wᵀ C Cᵀz / |Cᵀz|,  wᵀVw = 1
        ν = 2 / gᵀ cov(θ) g,  g_k = wᵀV_k w     (Satterthwaite, Biometrics 2, 1946, 110)

    over the variances θ_k between power-ons, each as large as it may be, one sigma more than it comes out: C
    then keeps to what changes within them as far as it can. What lies between is judged by their spread, and
    with few of them left beside the model any columns take all of it, however large that makes the ratio.

    stated: place of a variance -> b² that the spec says of it. One that the rows tell badly is as large, and
    as well known, as rows and budget say together (`by_both`): of four power-ons under load, two either way,
    an asymmetry of 17 sigma left two to say what their scale factors draw, which were eight budgets instead.
    """
    sample, theta = more.judged.sample, more.theta.copy()
    first = len(sample.effects.diagonals)
    between = slice(first, first + len(sample.effects.slopes))
    theta[between], share = _as_large_as_may_be(sample, theta, between, stated)
    v = covariance(sample.effects, theta)
    both = v.whiten(np.column_stack([sample.basis, sample.y]))
    Q = orthonormal(both[:, :columns])
    C, z = orthonormal(clear(Q, both[:, columns:-1])), clear(Q, both[:, -1:])
    h = C.T @ z
    delta = float(np.sum(h**2))
    g = v.within(v.whiten_transposed(C @ h / max(float(np.sqrt(delta)), 1e-300)))[between]
    error = _error(sample, theta, between)
    known = np.sqrt(np.maximum(np.diag(error), 1e-300))
    g = g * np.where(share > 0.0, share * theta[between] / known, 1.0)
    freedom = 2.0 / max(float(g @ error @ g), 1e-6)
    return bool(log_p(delta, C.shape[1], freedom, 1.0) <= -0.5 * (DECISIVE + np.log(more.rows)))


def _as_large_as_may_be(
    sample: Sample, theta: Array, between: slice, stated: Mapping[int, float]
) -> tuple[Array, Array]:
    """(s,) variances between power-ons, one sigma more than they come out, and that sigma as a share of them.

    The share is said where a budget counts, and 0 elsewhere.
    """
    error = np.sqrt(np.maximum(np.diag(_error(sample, theta, between)), 0.0))
    most, share = theta[between] + error, np.zeros(len(error))
    for k, b2 in stated.items():
        i = k - between.start
        if error[i] > KNOWN * theta[k]:
            halved = np.where(np.arange(len(theta)) == k, theta / 2.0, theta)
            half = float(np.sqrt(max(_error(sample, halved, between)[i, i], 0.0)))
            both, sigma = by_both(spread_law(float(theta[k]), float(error[i]), half), b2)
            most[i], share[i] = both + sigma, sigma / both
    return most, share


def _error(sample: Sample, theta: Array, some: slice) -> Array:
    """Covariance of what the rows tell of some of the variances, the others as if known."""
    return inverse_of(reml_information(sample, theta)[some, some])


def _predicts(more: Weighed, columns: int) -> bool:
    """Whether the last columns of a model, after so many, predict power-ons that their fit has not seen."""
    X, y = more.white
    Q = orthonormal(X[:, :columns])
    C, z = clear(Q, X[:, columns:]), clear(Q, y[:, None])[:, 0]
    gram = np.add.reduceat(C[:, :, None] * C[:, None, :], more.starts)
    h = np.add.reduceat(C * z[:, None], more.starts)
    H = h.sum(axis=0)
    explained = float(H @ inverse(gram.sum(axis=0)) @ H)
    return predicted(gram, h) > OF_A_TABLE * explained
