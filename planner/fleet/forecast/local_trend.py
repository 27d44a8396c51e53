"""Local level with drift: a line, a random walk on it, and measurement noise; exact over all its parameters.

    y_i = b + r t_i + u(t_i) + n_i,   u a random walk of λs²/δ per day, n_i ~ N(0, s² w_i),  δ the usual step

For a given λ everything is a closed form (generalised least squares, Zellner 1971): with flat priors for b,
r and ln s the true value at T + h has Student's t with n − 2 degrees of freedom around the best linear
prediction, the uncertainty of b, r and s included. λ has a grid, weighted by its marginal likelihood; the
prior of λ is that of the fleet (the mean of the weights of all series of a kind, iterated: empirical Bayes,
Robbins 1956), begun with a half-Cauchy law. statsmodels' UnobservedComponents (`structural`) has the same
model, fits it by maximum likelihood in 0.1 s a channel, and takes its parameters for certain, which four
points do not warrant; the tests hold both against each other at equal parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.fleet.forecast._method import Forecast, Past, alike, too_short
from planner.nouns.array import Array

# random walk per usual step over the noise, as variances: from a straight line to a pure random walk
RATIOS = np.concatenate([[0.0], np.geomspace(1e-4, 1e3, 22)])
ROUNDS = 300  # of the empirical prior: slow to settle where four points tell a ratio badly


@dataclass(frozen=True)
class _Fits:
    """Of m series and every λ: log likelihood (m, L), mean (m, L, h), variance (m, L, h), s² (m, L)."""

    likelihood: Array
    mean: Array
    variance: Array
    noise: Array


class LocalTrend:
    """The state-space model of drift in store."""

    name = "local_trend"
    least = 3
    slow = False
    needs = ""

    def forecast(self, series: Sequence[Past], ahead: Sequence[Array]) -> list[Forecast | str]:
        """One per series, ahead (h,) days."""
        found: list[Forecast | str] = [too_short(self, s) or "" for s in series]
        able = [i for i, why in enumerate(found) if not why]
        fits: dict[int, _Fits] = {}
        for group in alike([series[i] for i in able], [ahead[i] for i in able]):
            places = [able[g] for g in group]
            values = np.stack([series[i].value for i in places])
            fitted = _fitted(series[places[0]], values, np.asarray(ahead[places[0]], dtype=float))
            for row, i in enumerate(places):
                fits[i] = _Fits(*(getattr(fitted, name)[row] for name in _Fits.__dataclass_fields__))
        for kind in dict.fromkeys(series[i].kind for i in able):
            places = [i for i in able if series[i].kind == kind]
            weights = _weights(np.stack([fits[i].likelihood for i in places]))
            for i, weight in zip(places, weights, strict=True):
                found[i] = _mixed(fits[i], weight, len(series[i]) - 2.0)
        return found


def _fitted(one: Past, values: Array, ahead: Array) -> _Fits:
    """All series (m, n) that share days, weights and times ahead."""
    time = one.day - one.day[0]
    step = float(np.median(np.diff(time)))
    # in steps from the middle: b and r are then nearly uncorrelated and of one size
    t, later = (time - time.mean()) / step, (time[-1] + ahead - time.mean()) / step
    walk = np.minimum.outer(time, time) / step
    per = [_for_ratio(r, one.weights, walk, t, later, values) for r in RATIOS]
    likelihood, mean, variance, noise = (np.stack(p, axis=1) for p in zip(*per, strict=True))
    return _Fits(likelihood, mean, variance, noise)


def _for_ratio(
    ratio: float, weights: Array, walk: Array, t: Array, later: Array, values: Array
) -> tuple[Array, Array, Array, Array]:
    """log likelihood (m,), mean (m, h), variance (m, h), s² (m,) of one λ."""
    n = len(t)
    root = np.linalg.cholesky(np.diag(weights) + ratio * walk)
    X, y = (np.linalg.solve(root, a) for a in (np.stack([np.ones(n), t], axis=1), values.T))
    Q, R = np.linalg.qr(X)
    beta = np.linalg.solve(R, Q.T @ y)  # (2, m)
    rest = y - X @ beta
    freedom = n - 2.0
    squares = np.maximum((rest**2).sum(axis=0), 1e-300)
    log = -np.log(np.diag(root)).sum() - np.log(np.abs(np.diag(R))).sum() - 0.5 * freedom * np.log(squares)
    k = np.linalg.solve(
        root, ratio * walk[:, -1]
    )  # the walk later covaries with the data as its last value does
    ends = np.stack([np.ones(len(later)), later], axis=1)
    mean = (ends @ beta + k @ rest).T
    slack = np.linalg.solve(R.T, (ends - k @ X).T)
    own = ratio * (walk[-1, -1] + (later - t[-1])) - k @ k + (slack**2).sum(axis=0)
    scale = squares / freedom
    return log, mean, scale[:, None] * own, scale


def _weights(log: Array) -> Array:
    """(m, L) weights of the ratios for every series, under the prior that all of them together suggest."""
    likelihood = np.exp(log - log.max(axis=1, keepdims=True))
    prior = first = _first_prior()
    for _ in range(ROUNDS if len(log) > 1 else 0):
        each = likelihood * prior
        each /= each.sum(axis=1, keepdims=True)
        prior = (each.sum(axis=0) + first) / (len(each) + 1.0)
    each = likelihood * prior
    return np.asarray(each / each.sum(axis=1, keepdims=True))


def _first_prior() -> Array:
    """(L,) for a fleet of which nothing is known: half-Cauchy in the ratio of the sigmas (Gelman 2006).

    On a grid of equal steps of ln λ its density is √λ / (1 + λ); the straight line counts as the least step.
    """
    ratio = np.where(RATIOS > 0, RATIOS, np.min(RATIOS[RATIOS > 0], initial=1.0))
    weight = np.sqrt(ratio) / (1 + ratio)
    return np.asarray(weight / weight.sum())


def _mixed(fits: _Fits, weight: Array, freedom: float) -> Forecast:
    """One t distribution with the mean and the variance of the mixture over the ratios."""
    mean = weight @ fits.mean
    variance = weight @ (fits.variance + (fits.mean - mean) ** 2)
    return Forecast(mean, np.sqrt(np.maximum(variance, 0.0)), float(np.sqrt(weight @ fits.noise)), freedom)


METHOD = LocalTrend()
