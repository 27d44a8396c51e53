"""Variances θ of random effects by restricted maximum likelihood (REML): the search for the maximum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.random_effects import NoNoise, RandomEffects
from planner.solvers.restricted_likelihood import (
    Sample,
    State,
    average_information,
    derivatives,
    state_of,
)

MOST_STEPS = 60
_CONVERGED = 1e-7  # of the REML log-likelihood; θ is then within 0.05 % of a standard error
_LEAST_INFORMATION = 1e-12  # on a variance in units of the total: below it the rows do not tell it
_MOST = 1e4  # times the total variance of the rows that a component may be
_LEAST_CURVATURE = 1e-8  # of a combination of variances that the data hardly tell, relative to each alone
_LEAST_SHARE = 1e-9  # of the total variance, below which a component counts as none


@dataclass(frozen=True)
class Variances:
    """REML estimates. theta: (K,) in the order of RandomEffects; error: (K, K) their covariance.

    free: (K,) False where the estimate is zero and held there (its row of `error` is zero)
    """

    theta: Array
    error: Array
    free: NDArray[np.bool_]
    loglik: float
    converged: bool


def reml(
    y: Array, X: Array, effects: RandomEffects, start: Array | None = None, settled: float = _CONVERGED
) -> Variances:
    """Variances θ >= 0 that maximise the restricted likelihood of y (n,) given X (n, p).

    Scoring with the average, at the end the expected information; components driven below zero are held at
    zero and released when their score turns positive. settled: gain of the log-likelihood at which the search
    ends, 1e-3 leaves θ within 5 % of a standard error. Raises ValueError when no degree of freedom is left
    for the noise.
    """
    return reml_together([Sample(y, X, effects)], start, settled)


def reml_together(
    samples: Sequence[Sample], start: Array | None = None, settled: float = _CONVERGED
) -> Variances:
    """Variances that several independent samples share, each with coefficients of its own.

    The likelihoods are multiplied. Raises ValueError as `reml`.
    """
    return reml_and_information(samples, start, settled)[0]


def reml_and_information(
    samples: Sequence[Sample], start: Array | None = None, settled: float = _CONVERGED
) -> tuple[Variances, Array]:
    """The same, and the expected information (K, K) on all variances there, those at zero too.

    Its inverse is how well the data could tell θ, whatever they told (Variances.error leaves out zeros).
    """
    found, information = reml_and_each(samples, start, settled)
    return found, np.sum(information, axis=0)


def reml_and_each(
    samples: Sequence[Sample], start: Array | None = None, settled: float = _CONVERGED
) -> tuple[Variances, Array]:
    """The same, and the expected information (S, K, K) of every sample."""
    count = samples[0].effects.count
    freedom = [len(s.y) - s.basis.shape[1] for s in samples]
    if min(freedom) < 1:
        raise ValueError("as many coefficients as rows: nothing is left to estimate the noise from")
    total = sum(float(s.left @ s.left) for s in samples) / sum(freedom)
    if total <= 0.0:
        nothing = np.zeros((len(samples), count, count))
        return Variances(np.zeros(count), nothing[0], np.zeros(count, bool), 0.0, True), nothing
    size = np.mean([s.effects.mean_sizes() for s in samples], axis=0)
    parts = [in_units(s, size, total) for s in samples]
    sought = samples[0].effects.free
    theta = np.full(count, 1.0 / count) if start is None else start * size / total
    theta = np.maximum(theta, 1e-3 * (np.arange(count) == 0))
    theta = np.where(sought, theta, size / total)
    found = _scored(parts, theta, sought, settled)
    free = (found.theta > 0) & sought
    error = np.zeros((count, count))
    error[np.ix_(free, free)] = np.linalg.pinv(found.information.sum(axis=0)[np.ix_(free, free)])
    factor = total / size
    scale = np.outer(factor, factor)
    loglik = found.loglik - 0.5 * sum(freedom) * float(np.log(total))
    return Variances(found.theta * factor, error * scale, free, loglik, found.done), found.information / scale


def in_units(sample: Sample, size: Array, total: float) -> Sample:
    """What a search asks: `left` over √total, V_k over sizes (K,), groups of one size together."""
    s = sample.by_size
    return Sample(s.y / np.sqrt(total), s.basis, s.effects.scaled(1.0 / size), True)


@dataclass(frozen=True)
class _Scored:
    """Where the search ended. information: (S, K, K) the expected ones; done: whether it settled there."""

    theta: Array
    information: Array
    loglik: float
    done: bool


def _scored(samples: Sequence[Sample], theta: Array, sought: NDArray[np.bool_], least: float) -> _Scored:
    """θ (K,) from a start; sought: (K,) variances that are not known.

    A last step of the expected information that gains less than `least` is not made: the information stays
    that of θ, and a derivative costs as much as ten likelihoods.
    """
    states, done, expected = _states(samples, theta), False, False
    for _ in range(MOST_STEPS):
        score, information = _slope(states, expected)
        step = step_within(theta, score, information.sum(axis=0), sought)
        new, better = improved(samples, theta, step, _total(states))
        settled = better is None or _total(better) - _total(states) < least
        if settled and expected:
            done = True
            break
        if better is not None:
            theta, states = new, better
        expected = settled  # the average information may be blind to a component; the expected one is not
    if not done:
        _, information = _slope(states, True)
    theta = np.where((theta > _LEAST_SHARE) | ~sought, theta, 0.0)
    return _Scored(theta, information, _total(states), done)


def step_within(theta: Array, score: Array, information: Array, free: NDArray[np.bool_]) -> Array:
    """(K,) to the maximum of the quadratic sᵀd − ½ dᵀI d with θ + d >= 0: uphill, whatever is at its bound.

    Every variance in units of its own error, or a large one would count as unseen. Least squares with bounds:
    Lawson, Hanson, Solving Least Squares Problems, 1974, 23.
    """
    free = free & (np.diag(information) > _LEAST_INFORMATION)
    step = np.zeros_like(score)
    if not free.any():
        return step
    unit = np.sqrt(np.diag(information)[free])
    curvature = information[np.ix_(free, free)] / np.outer(unit, unit)
    value, vector = np.linalg.eigh(curvature)
    root = np.sqrt(np.maximum(value, _LEAST_CURVATURE))
    at = theta[free] * unit
    target = (vector / root).T @ (score[free] / unit) + (vector * root).T @ at
    found = (vector / root) @ target
    if (found < 0.0).any():
        from scipy.optimize import nnls

        found, _ = nnls((vector * root).T, target, maxiter=30 * len(at))
    step[free] = np.minimum(found / unit, _MOST) - theta[free]
    return step


def _states(samples: Sequence[Sample], theta: Array) -> list[State]:
    return [state_of(s.y, s.X, s.effects, theta) for s in samples]


def _total(states: Sequence[State]) -> float:
    return sum(s.loglik for s in states)


def _slope(states: Sequence[State], expected: bool) -> tuple[Array, Array]:
    """Score (K,) of all samples together and information (S, K, K) of each."""
    parts = [derivatives(s) if expected else average_information(s) for s in states]
    return np.sum([p[0] for p in parts], axis=0), np.array([p[1] for p in parts])


def improved(
    samples: Sequence[Sample], theta: Array, step: Array, now: float
) -> tuple[Array, list[State] | None]:
    """The longest halved step that raises the likelihood; the noise keeps a tenth of what it was.

    One so long that V has no factor in rounding is too long.
    """
    floor = np.where(np.arange(len(theta)) == 0, 0.1 * theta[0], 0.0)
    for halving in range(12):
        new = np.maximum(theta + step * 0.5**halving, floor)
        try:
            states = _states(samples, new)
        except NoNoise:
            continue
        if np.isfinite(_total(states)) and _total(states) > now:
            return new, states
    return theta, None
