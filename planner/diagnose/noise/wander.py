"""What moves within power-ons: a bias that walks or steps while the unit is on, record after record.

    y = X c + x(t) + e,   cov x = σ² exp(−|Δt| / τ) in every power-on,   cov e = V(θ) of `noise`

σ² and θ together by REML under what is declared and was found, τ the budget's correlation time: whatever else
walks or steps within power-ons has a part along it. A channel has such a process where its restricted
likelihood is so much larger with it that chance, half a χ² of one degree (Self, Liang, JASA 82, 1987), does
so once in 10 000. What the noise of `noise` takes for it otherwise is part level, part white, and every curve
over time or over what changes with it explains ten sigma of nothing; so where the rows show one of any
correlation time it is part of that noise from the beginning (`with_wander`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import clear, explained, orthonormal
from planner.diagnose.noise.channel_noise import (
    LEAST_RUNS,
    SETTLED,
    TOLD,
    ChannelNoise,
    Readings,
    inverse_of,
    judged_rows,
    without_zeros,
)
from planner.diagnose.noise.components import IN_RUN, IN_RUN_SCALE, RATE_NOISE
from planner.diagnose.noise.weighed_columns import Weighed, weighed
from planner.diagnose.noise.whitened import Whitened
from planner.nouns.array import Array
from planner.solvers.block_covariance import LARGEST, BlockCovariance
from planner.solvers.distributions import chi_square_tail
from planner.solvers.least_squares import factors
from planner.solvers.random_effects import Covariance, Drift, covariance
from planner.solvers.reml import Variances, reml_and_information, reml_together
from planner.solvers.reml_beside import promised, reml_roughly
from planner.solvers.restricted_likelihood import Sample, restricted_loglik

CHANCE = 1e-4  # of a channel that does not wander; tails of Student's t of 3 degrees make a few of it
CHANCE_AT_FIRST = 1e-2  # the same before anything is believed: what is counted on in vain costs little
LEAST_TO_WANDER = 4  # power-ons; in one a drift and a walk are the same
LEAST_ROWS = 50  # beside a model's columns, of few power-ons: each takes a level from them
TIMES_S = (60.0, 200.0, 600.0, 2000.0)  # correlation times that are asked
LARGEST_AT_FIRST = 256  # rows of a power-on
SETTLED_ROUGHLY = 0.1  # of the log-likelihood
PROMISED = 3.0  # of 2 log L, below which no likelihood of a process is sought: chance asks for 7.4 and more
CLOSE = 0.5  # of what the best correlation time promises, below which one is not the best
AT_FIRST_SIGHT = 1.0  # sigma of the correlation of neighbours, below which no likelihood is asked


def with_wander(readings: Readings, plain: Weighed | None, time_on: Array) -> Readings:
    """The readings with such processes, of the likeliest correlation times, where their rows show them.

    Of the bias, and of the scale factor, for which noise that grows with the input of a record stands else.
    plain: how they weigh under their own candidates; what hides in the noise went in before
    """
    u = readings.channel.u
    if plain is not None and neighbours(plain.left, plain.starts) >= AT_FIRST_SIGHT:
        drift = _shown(readings, plain, np.ones(len(time_on)), time_on)
        if drift is not None:
            readings = readings.with_noise(drifts={IN_RUN: drift})
            plain = weighed(readings)
    if plain is None or RATE_NOISE not in plain.judged.components:
        return readings
    if plain.theta[plain.judged.components.index(RATE_NOISE)] * float(np.max(u**2)) < plain.theta[0]:
        return readings
    drift = _shown(readings, plain, u, time_on)
    return readings if drift is None else readings.with_noise(drifts={**readings.drifts, IN_RUN_SCALE: drift})


def _shown(readings: Readings, plain: Weighed, z: Array, time_on: Array) -> Drift | None:
    """The process of a column z (n,) that the rows show; None where they show none."""
    sample = plain.judged.sample
    if len(readings.starts) < LEAST_TO_WANDER or int(sample.effects.sizes.max()) > LARGEST_AT_FIRST:
        return None
    if len(readings.starts) < LEAST_RUNS and len(sample.y) - sample.basis.shape[1] < LEAST_ROWS:
        return None
    rows, _ = judged_rows(readings.starts, len(time_on))
    drifts = [Drift(z, time_on, tau) for tau in TIMES_S]
    own = sample.effects.drifts
    promises = promised_by(sample, plain.theta, [d.at(rows) for d in drifts])
    if promises.max() < PROMISED:
        return None
    drifts = [d for d, p in zip(drifts, promises, strict=True) if p >= CLOSE * promises.max()]
    moving = [replace(sample, effects=replace(sample.effects, drifts=(*own, d.at(rows)))) for d in drifts]
    first = _first(plain.theta, sample.y) / max(float(np.mean(z**2)), 1e-300)
    found = [reml_roughly(m, np.append(plain.theta, first), SETTLED_ROUGHLY) for m in moving]
    best = int(np.argmax([f.loglik for f in found]))
    gain = gained(sample, plain.theta, moving[best], found[best].theta)
    if gain <= 0.0 or 0.5 * len(TIMES_S) * float(chi_square_tail(gain, 1)) > CHANCE_AT_FIRST:
        return None
    largest = np.argmax(np.add.reduceat(_products(plain.left, plain.starts), plain.starts))
    rest = [_of_some(s, np.arange(len(plain.starts)) != largest) for s in (sample, moving[best])]
    if gained(rest[0], plain.theta, rest[1], found[best].theta) <= 0.0:
        return None  # one step of one power-on is no process of all
    return drifts[best]


def promised_by(sample: Sample, theta: Array, drifts: Sequence[Drift]) -> Array:
    """(q,) of 2 log L that each of some processes promises beside a sample's variances at their θ (K,)."""
    every = replace(sample.effects, drifts=(*sample.effects.drifts, *drifts))
    return promised(replace(sample, effects=every), np.append(theta, np.zeros(len(drifts))), len(drifts))


def can_tell(w: Whitened, largest: int = LARGEST) -> bool:
    """Whether rows without such a process would show that: of several power-ons, none of more than `largest`.

    In one record a drift and a walk are the same.
    """
    return len(w.noise.starts) >= LEAST_TO_WANDER and int(w.noise.sample.effects.sizes.max()) <= largest


def wander(
    w: Whitened,
    believed: Array,
    time_on: Array,
    tau: float,
    most: float = CHANCE,
    largest: int = LARGEST,
) -> ChannelNoise | None:
    """The noise of a channel with such a process, its variance the last; None where the rows show none.

    believed: (n, k) columns of what was found on it; most: chance from which they show none; largest: rows of
    a power-on up to which they are asked
    """
    white = w.noise.whiten(believed)
    left = clear(orthonormal(clear(w.Q, white), TOLD), w.z)
    effects = w.noise.sample.effects
    shown = bool(effects.drifts) or neighbours(left, w.noise.starts) >= AT_FIRST_SIGHT
    if not shown or int(effects.sizes.max()) > largest:
        return None
    sample, drift, start = _sample(w, believed, time_on, tau)
    try:
        plain = reml_together([sample], start, SETTLED)
        found, loglik = _with(sample, drift, plain.theta)
    except ValueError:
        return None
    gain = 2.0 * (loglik - restricted_loglik(sample, plain.theta))
    chance = 0.5 * float(chi_square_tail(gain, 1)) if gain > 0.0 else 1.0
    if chance > most or found.theta[-1] <= 0.0:
        return None
    (known,) = without_zeros([found])
    return replace(
        w.noise,
        variances=known,
        components=(*w.noise.components[: len(start)], IN_RUN),
        rows=None,
        sample=replace(sample, effects=replace(sample.effects, drifts=(drift,))),
    )


def left_of(w: Whitened, believed: Array, time_on: Array, tau: float) -> float:
    """Share of Δ of believed columns (n, k) where the process is as large as the rows allow, 0 … 1.

    Its variance is the estimate beside them, or what one that comes out as zero may well be: a drift of a few
    sigma is not told from a process that the rows do not refuse. 0 where nothing can be said.
    """
    sample, drift, start = _sample(w, believed, time_on, tau)
    rows, _ = judged_rows(w.noise.starts, len(w.z))
    known = np.column_stack([w.channel.J, w.noise.fixed_runs])[rows]
    try:
        plain = reml_together([sample], start, SETTLED)
        (moving,) = without_zeros([_with(sample, drift, plain.theta)[0]])
    except ValueError:
        return 0.0
    both = (sample.effects, plain.theta), (replace(sample.effects, drifts=(drift,)), moving.theta)
    before, after = (_explained(covariance(e, t), known, believed[rows], sample.y) for e, t in both)
    return min(after / before, 1.0) if before > 0.0 else 0.0


def _sample(w: Whitened, believed: Array, time_on: Array, tau: float) -> tuple[Sample, Drift, Array]:
    """The rows that tell the variances, under what is declared and believed; the process on them.

    And the other variances (K,), from which they are sought.
    """
    rows, _ = judged_rows(w.noise.starts, len(w.z))
    basis = factors(np.column_stack([w.channel.J, believed, w.noise.fixed_runs])[rows], TOLD).basis
    effects = replace(w.noise.sample.effects, drifts=())
    sample = Sample(w.channel.r[rows], basis, effects, True)
    return sample, Drift(np.ones(len(rows)), time_on[rows], tau), w.noise.variances.theta[: effects.count]


def _explained(v: Covariance | BlockCovariance, known: Array, columns: Array, y: Array) -> float:
    """Δ, the drop of yᵀPy by columns beside what is known."""
    return explained(v.whiten(known), v.whiten(columns), v.whiten(y[:, None])[:, 0], TOLD)[0]


def _with(sample: Sample, drift: Drift, theta: Array) -> tuple[Variances, float]:
    """REML with the process, from a start without it, and its restricted log-likelihood."""
    effects = replace(sample.effects, drifts=(drift,))
    start = np.append(theta, _first(theta, sample.y))
    moving = replace(sample, effects=effects)
    found, information = reml_and_information([moving], start, SETTLED)
    return replace(found, error=inverse_of(information)), restricted_loglik(moving, found.theta)


def gained(without: Sample, start: Array, moving: Sample, theta: Array) -> float:
    """2 (log L of a sample with more noise, at θ, − log L without at its best), restricted likelihoods."""
    rough = reml_roughly(without, start, SETTLED_ROUGHLY)
    here = restricted_loglik(moving, theta)
    if here <= rough.loglik:
        return 0.0
    best = reml_together([without], rough.theta, SETTLED_ROUGHLY)  # a variance may wake up
    return 2.0 * (here - best.loglik)


def _of_some(sample: Sample, stays: NDArray[np.bool_]) -> Sample:
    """Some of the power-ons of a sample (g,)."""
    rows = np.repeat(stays, sample.effects.sizes)
    return Sample(sample.y[rows], sample.basis[rows], sample.effects.at(stays))


def _first(theta: Array, y: Array) -> float:
    """The process' variance from which it is sought: that of the white noise."""
    return max(float(theta[0]), 1e-3 * float(np.var(y)))


def neighbours(z: Array, starts: NDArray[np.int64]) -> float:
    """Σ z_i z_j of neighbours within power-ons over its standard error under independence, z (n,) white."""
    products = _products(z, starts)
    error = float(np.linalg.norm(products))
    return float(products.sum()) / error if error > 0.0 else 0.0


def _products(z: Array, starts: NDArray[np.int64]) -> Array:
    """(n,) of every row and the one before it in its power-on."""
    products = np.append(0.0, z[1:] * z[:-1])
    products[starts] = 0.0
    return np.asarray(products)
