"""Whether a claim stands in the channel's own noise, which may wander within power-ons.

A bias that wanders while the unit is on gives tables over the time, or over the rate of temperature, fourteen
sigma of nothing: they follow it record after record, and what they leave looks white. Where all candidates
together judge the noise they take the process up, and `wander` sees none before anything is believed. Where
the likelihood shows it beside what is, that is asked again,

    V' = V(θ) + σ² exp(−|Δt| / τ) in every power-on,   Δ' = yᵀP'_0 y − yᵀP' y

σ², θ by REML beside all that is believed, τ the one of a few that the likelihood prefers. Δ' must be beyond
chance by an F test with the degrees of freedom of the variances of V' (Satterthwaite), or be most of Δ.

What tells power-ons apart is asked as one test for each day that it had to choose: a dozen levels leave few
degrees of freedom, and a wander says little of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.hypotheses.found import ALPHA, ALPHA_UNKNOWN, SINGLE, Found
from planner.diagnose.noise.channel_noise import (
    LEAST_RUNS,
    SETTLED,
    TOLD,
    inverse_of,
    judged_rows,
    least_freedom,
    without_zeros,
)
from planner.diagnose.noise.wander import PROMISED, promised_by
from planner.diagnose.noise.whitened import Whitened, log_p
from planner.nouns.array import Array
from planner.solvers.block_covariance import BlockCovariance, block_covariance
from planner.solvers.distributions import chi_square_tail
from planner.solvers.least_squares import factors
from planner.solvers.random_effects import Drift, covariance
from planner.solvers.reml import Variances, reml_and_information
from planner.solvers.restricted_likelihood import Sample, restricted_loglik

TAUS_S = (150.0, 600.0, 2400.0)  # shorter it is white, longer a level of the power-on
LARGEST = 400  # records of a power-on: its block of the covariance is dense
CHANCE = 0.01  # of a channel on which nothing wanders, by half a χ² of one degree for each τ
KEPT = 0.8  # of Δ, from which the noise explains nothing of it
BETWEEN = 0.8  # of the square of columns that is the power-ons' means: they tell these apart


def stands_in_own_noise(found: Found, b: int) -> bool:
    """Whether a believed block of one channel is beyond chance in noise that is the channel's own."""
    pool, block = found.pool, found.pool.blocks[b]
    (axis,) = block.columns
    w, mine = pool.state[axis], block.columns[axis]
    if not _can_tell(w) or w.noise.sample.effects.drifts:
        return True
    others = [pool.blocks[i].columns[axis] for i in found.others(b) if axis in pool.blocks[i].columns]
    beside = np.column_stack([w.channel.J, w.noise.fixed_runs, *others])
    between = of_means(mine, w.noise.starts) > BETWEEN
    try:
        sample, v, wanders = _own_noise(w, w.channel.r, np.column_stack([beside, mine]))
        if not wanders:
            return True
        rows, _ = judged_rows(w.noise.starts, len(w.z))
        delta, tail = _tested(sample, v, beside[rows], mine[rows])
    except ValueError:
        return True
    return delta >= KEPT * found.share(b).delta or tail <= np.log(_alpha(found, b, between))


def wandering(w: Whitened, y: Array, believed: Array) -> BlockCovariance | None:
    """V' of a channel whose readings y (n,) wander beside columns (n, k); None where they do not for sure."""
    if isinstance(w.noise.covariance, BlockCovariance):
        return w.noise.covariance
    if not _can_tell(w) or len(y) - believed.shape[1] < least_freedom(w.noise.starts):
        return None
    try:
        sample, v, wanders = _own_noise(w, y, believed)
    except ValueError:
        return None
    if not wanders:
        return None
    one, time_on = np.ones(len(y)), w.channel.model.conditions.time_on
    drift = Drift(one, time_on, sample.effects.drifts[0].tau)
    return block_covariance(replace(w.noise.covariance.effects, drifts=(drift,)), v.theta)


def _can_tell(w: Whitened) -> bool:
    """Whether rows tell a walk from a drift: in one record they are the same."""
    return len(w.noise.starts) >= LEAST_RUNS and int(w.noise.covariance.effects.sizes.max()) <= LARGEST


def _alpha(found: Found, b: int, between: bool) -> float:
    """The chance that one test may have."""
    blocks = found.pool.blocks
    if between:
        return SINGLE / sum(x.key == blocks[b].key for x in blocks)
    return (ALPHA_UNKNOWN if blocks[b].generic else ALPHA) / len({x.key for x in blocks})


def _own_noise(w: Whitened, y: Array, believed: Array) -> tuple[Sample, Variances, bool]:
    """The rows of y (n,) that tell the variances beside columns (n, k), these, and whether they wander."""
    rows, _ = judged_rows(w.noise.starts, len(w.z))
    basis = factors(believed[rows], TOLD).basis
    plain = Sample(y[rows], basis, w.noise.sample.effects, True)
    level, without = _variances(plain, w.noise.variances.theta)
    first = level.theta[0] if level.theta[0] > 0.0 else 1e-3 * float(np.var(plain.y))
    one, time_on = np.ones(len(rows)), w.channel.model.conditions.time_on[rows]
    drifts = [Drift(one, time_on, tau) for tau in TAUS_S]
    promises = promised_by(plain, level.theta, drifts)
    if promises.max() < PROMISED:
        return plain, without_zeros([level])[0], False
    moving = [replace(plain, effects=replace(plain.effects, drifts=(d,))) for d in drifts]
    each = [_variances(sample, np.append(level.theta, first)) for sample in moving]
    k = int(np.argmax([loglik for _, loglik in each]))
    gain = 2.0 * (each[k][1] - without)
    wanders = gain > 0.0 and 0.5 * len(TAUS_S) * float(chi_square_tail(gain, 1)) < CHANCE
    (known,) = without_zeros([each[k][0] if wanders else level])
    return moving[k] if wanders else plain, known, wanders


def _variances(sample: Sample, start: Array) -> tuple[Variances, float]:
    """REML and its restricted log-likelihood."""
    found, information = reml_and_information([sample], start, SETTLED)
    return replace(found, error=inverse_of(information)), restricted_loglik(sample, found.theta)


def _tested(sample: Sample, v: Variances, beside: Array, mine: Array) -> tuple[float, float]:
    """Δ' of columns (n, k) beside others and log p, with Satterthwaite's freedom of its contrasts."""
    V = covariance(sample.effects, v.theta)
    left = clear(orthonormal(V.whiten(beside), TOLD), V.whiten(np.column_stack([sample.y, mine])))
    C = orthonormal(left[:, 1:], TOLD)
    delta = float(np.sum((C.T @ left[:, 0]) ** 2))
    U, m = V.whiten_transposed(C), max(C.shape[1], 1)
    images = (sample.effects.times(k, U) for k in range(len(v.theta)))
    share = np.array([t * float(np.vdot(U, x)) / m for t, x in zip(v.theta, images, strict=True)])
    size = np.outer(v.theta, v.theta)
    relative = np.divide(v.error, size, out=np.zeros_like(size), where=size > 0)
    freedom = float(np.clip(2.0 / max(share @ relative @ share, 1e-12), 1.0, 1e6))
    return delta, float(log_p(delta, C.shape[1], freedom, 1.0))


def of_means(columns: Array, starts: NDArray[np.int64]) -> float:
    """Share of the square of columns (n, k), each about its mean, that is the power-ons' means."""
    about = columns - columns.mean(axis=0)
    sizes = np.diff(np.append(starts, len(about)))
    means = np.add.reduceat(about, starts) / sizes[:, None]
    return float(np.sum(sizes[:, None] * means**2) / max(float(np.sum(about**2)), 1e-300))
