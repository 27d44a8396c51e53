"""Variances θ of random effects by restricted maximum likelihood (REML).

X enters through an orthonormal basis of its columns, so that the inverse of XᵀV⁻¹X is one of a
well-conditioned matrix however ill-conditioned X is. Source: Patterson, Thompson, Biometrika 58 (1971) 545.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.block_covariance import BlockCovariance
from planner.solvers.least_squares import factors
from planner.solvers.random_effects import Covariance, RandomEffects, covariance

_MOST_STEPS = 60
_CONVERGED = 1e-7  # of the REML log-likelihood; θ is then within 0.05 % of a standard error
_LEAST_INFORMATION = 1e-12  # on a variance in units of the total: below it the rows do not tell it
_MOST = 1e4  # times the total variance of the rows that a component may be
_LEAST_CURVATURE = 1e-8  # of a combination of variances that the data hardly tell, relative to each alone
_LEAST_SHARE = 1e-9  # of the total variance, below which a component counts as none


# ---------------------------------------------------------------- the restricted likelihood


@dataclass(frozen=True)
class _State:
    """Everything at one θ: y (n,) and X (n, r), what V weighs them to, log-likelihood.

    information: (r, r) XᵀV⁻¹X; h: (r,) XᵀV⁻¹y; factor: (r, r) Cholesky's of the information, where it has one
    """

    v: Covariance | BlockCovariance
    y: Array
    X: Array
    information: Array
    h: Array
    factor: Array | None
    loglik: float

    @cached_property
    def half(self) -> Array:
        """(r, r) whose halfᵀ half is (XᵀV⁻¹X)⁻¹."""
        if self.factor is not None:
            return _inverse_of_triangle(self.factor)
        return _inverse_root(self.information)

    @cached_property
    def root(self) -> Array:
        """(n, r) V⁻¹X halfᵀ: P = V⁻¹ − root rootᵀ."""
        return self.v.solve(self.X @ self.half.T)

    @cached_property
    def Py(self) -> Array:
        """(n,) V⁻¹ of what generalised least squares leaves of y."""
        left = self.y - self.X @ (self.half.T @ (self.half @ self.h))
        return self.v.solve(left[:, None])[:, 0]


def _state(y: Array, X: Array, effects: RandomEffects, theta: Array) -> _State:
    """REML log-likelihood −½ (log|V| + log|XᵀV⁻¹X| + yᵀPy) at θ; y (n,), X (n, r) orthonormal.

    The last pivot of Cholesky's factor of [X, y]ᵀV⁻¹[X, y], squared, is yᵀPy.
    """
    v = covariance(effects, theta)
    both = v.quadratic(np.column_stack([X, y]))
    information, h = both[:-1, :-1], both[:-1, -1]
    factor = None
    try:
        triangle = np.asarray(np.linalg.cholesky(both), dtype=float)
        factor, pivots = triangle[:-1, :-1], np.diag(triangle)
        log = 2.0 * float(np.log(pivots[:-1]).sum()) + float(pivots[-1]) ** 2
    except np.linalg.LinAlgError:  # rounding leaves it no longer positive definite
        half = _inverse_root(information)
        log = float(np.linalg.slogdet(information)[1] + both[-1, -1] - np.sum((half @ h) ** 2))
    return _State(v, y, X, information, h, factor, -0.5 * (v.log_determinant + log))


def _inverse_root(information: Array) -> Array:
    """(r, r) half with halfᵀ half the inverse; of the positive part where it is not positive definite."""
    try:
        return _inverse_of_triangle(np.asarray(np.linalg.cholesky(information), dtype=float))
    except np.linalg.LinAlgError:
        value, vector = np.linalg.eigh((information + information.T) / 2.0)
        seen = value > max(float(value[-1]), 0.0) * np.finfo(float).eps
        return np.asarray((vector[:, seen] / np.sqrt(value[seen])).T)


def _inverse_of_triangle(L: Array) -> Array:
    """L⁻¹ of a lower triangle (r, r): a fourth of the time of any matrix's inverse."""
    from scipy.linalg.lapack import dtrtri

    return np.asarray(dtrtri(L, lower=1)[0])


def _derivatives(s: _State) -> tuple[Array, Array]:
    """Score (K,) and expected information (K, K): traces of V_k and P = V⁻¹ − root rootᵀ."""
    v = s.v
    quadratic = _quadratics(s)
    trace = np.array([v.trace(k) for k in range(v.effects.count)]) - v.within(s.root)
    information = v.double_traces() - 2.0 * v.between(s.root)
    return 0.5 * (quadratic - trace), 0.5 * information


def _quadratics(s: _State) -> Array:
    """(K,) yᵀPV_kPy."""
    e = s.v.effects
    return np.array([float(s.Py @ e.times(k, s.Py[:, None])[:, 0]) for k in range(e.count)])


def _average_information(s: _State) -> tuple[Array, Array]:
    """Score (K,) and average information (K, K), ½ yᵀPV_kPV_lPy (Gilmour, Thompson, Cullis 1995).

    As good a curvature for the search as the expected one, for K products of matrices in place of K².
    """
    e = s.v.effects
    pulled = np.column_stack([e.times(k, s.Py[:, None]) for k in range(e.count)])
    taken = s.root.T @ pulled
    trace = np.array([s.v.trace(k) for k in range(e.count)]) - s.v.within(s.root)
    information = s.v.quadratic(pulled) - taken.T @ taken
    return 0.5 * (s.Py @ pulled - trace), 0.5 * information


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


@dataclass(frozen=True)
class Sample:
    """One data set for the variances: y (n,) given X (n, p), with what its V is made of.

    orthonormal: whether X is so already
    """

    y: Array
    X: Array
    effects: RandomEffects
    orthonormal: bool = False

    @cached_property
    def basis(self) -> Array:
        """(n, r) orthonormal columns that span those of X; made once for all θ that are asked."""
        return self.X if self.orthonormal else factors(self.X).basis

    @cached_property
    def left(self) -> Array:
        """(n,) y without what X explains of it by plain least squares."""
        return np.asarray(self.y - self.basis @ (self.basis.T @ self.y))


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
    count = samples[0].effects.count
    freedom = [len(s.y) - s.basis.shape[1] for s in samples]
    if min(freedom) < 1:
        raise ValueError("as many coefficients as rows: nothing is left to estimate the noise from")
    total = sum(float(s.left @ s.left) for s in samples) / sum(freedom)
    if total <= 0.0:
        nothing = np.zeros((count, count))
        return Variances(np.zeros(count), nothing, np.zeros(count, bool), 0.0, True), nothing
    size = np.mean([s.effects.mean_sizes() for s in samples], axis=0)
    parts = [Sample(s.left / np.sqrt(total), s.basis, s.effects.scaled(1.0 / size), True) for s in samples]
    sought = samples[0].effects.free
    theta = np.full(count, 1.0 / count) if start is None else start * size / total
    theta = np.maximum(theta, 1e-3 * (np.arange(count) == 0))
    theta = np.where(sought, theta, size / total)
    found = _scored(parts, theta, sought, settled)
    free = (found.theta > 0) & sought
    error = np.zeros((count, count))
    error[np.ix_(free, free)] = np.linalg.pinv(found.information[np.ix_(free, free)])
    factor = total / size
    scale = np.outer(factor, factor)
    loglik = found.loglik - 0.5 * sum(freedom) * float(np.log(total))
    return Variances(found.theta * factor, error * scale, free, loglik, found.done), found.information / scale


def restricted_loglik(sample: Sample, theta: Array) -> float:
    """−½ (log|V| + log|QᵀV⁻¹Q| + yᵀPy) at θ, Q an orthonormal basis of X: differences over θ count."""
    return _state(sample.left, sample.basis, sample.effects, theta).loglik


def reml_roughly(
    sample: Sample, start: Array, settled: float, first: Slope | None = None
) -> tuple[Array, float]:
    """θ (K,) from a start by the average information alone, and `loglik` there: for models that lie apart.

    The search ends where a step gains less than `settled`; a component that is zero there may stay so.
    first: the likelihood at the start and its slope, where they are known
    """
    size, total = _units(sample, start)
    part, sought = _in_units(sample, size, total), sample.effects.free
    theta = np.asarray(start * size / total)
    here = _slope_of(_state(part.y, part.X, part.effects, theta)) if first is None else first
    for _ in range(_MOST_STEPS):
        step = _step(theta, here.score, here.information, sought)
        new, better = _improved([part], theta, step, here.loglik)
        if better is None:
            break
        gained = better[0].loglik - here.loglik
        theta = new
        if gained < settled:
            return theta * total / size, _of_the_rows(better[0]) - _of_units(sample, total)
        here = _slope_of(better[0])
    return np.asarray(theta * total / size), here.of_the_rows - _of_units(sample, total)


@dataclass(frozen=True)
class Slope:
    """What a search asks of one θ: the likelihoods of `restricted_loglik` and `loglik`, score, information.

    All of variances in units of `_units`; score (K,), information (K, K) the average one.
    """

    loglik: float
    of_the_rows: float
    score: Array
    information: Array


def _slope_of(s: _State) -> Slope:
    return Slope(s.loglik, _of_the_rows(s), *_average_information(s))


@dataclass(frozen=True)
class Grounds:
    """One θ (K,) of a sample, from which models with a few columns more are asked for their slope there."""

    sample: Sample
    theta: Array

    @cached_property
    def _state(self) -> _State:
        size, total = _units(self.sample, self.theta)
        part = _in_units(self.sample, size, total)
        return _state(part.y, part.X, part.effects, self.theta * size / total)

    @cached_property
    def _traces(self) -> Array:
        """(K,) tr P V_k."""
        s = self._state
        return np.array([s.v.trace(k) for k in range(s.v.effects.count)]) - s.v.within(s.root)

    def with_columns(self, B: Array) -> Slope | None:
        """With more columns B (n, m) that are orthonormal beside those of the sample; None: hardly beside.

        P = V⁻¹ − root rootᵀ loses new newᵀ, new = P B L⁻ᵀ, L Lᵀ = Bᵀ P B: work of m columns, not of all.
        """
        s = self._state
        PB = s.v.solve(B) - s.root @ (s.root.T @ B)
        try:
            triangle = np.asarray(np.linalg.cholesky(B.T @ PB), dtype=float)
        except np.linalg.LinAlgError:
            return None
        new = PB @ _inverse_of_triangle(triangle).T
        seen = new.T @ s.y
        Py = s.Py - new @ seen
        e = s.v.effects
        pulled = np.column_stack([e.times(k, Py[:, None]) for k in range(e.count)])
        taken, own = s.root.T @ pulled, new.T @ pulled
        information = s.v.quadratic(pulled) - taken.T @ taken - own.T @ own
        explained, log = float(seen @ seen), 2.0 * float(np.log(np.diag(triangle)).sum())
        return Slope(
            s.loglik + 0.5 * (explained - log),
            _of_the_rows(s) + 0.5 * explained,
            0.5 * (Py @ pulled - (self._traces - s.v.within(new))),
            0.5 * information,
        )


def _units(sample: Sample, start: Array) -> tuple[Array, float]:
    """(K,) the size of each variance's part and their sum at θ: a search goes in these."""
    size = sample.effects.mean_sizes()
    return size, float(np.sum(start * size))


def _in_units(sample: Sample, size: Array, total: float) -> Sample:
    return Sample(sample.left / np.sqrt(total), sample.basis, sample.effects.scaled(1.0 / size), True)


def _of_units(sample: Sample, total: float) -> float:
    """What a log-likelihood in units is more than one of the rows as they are."""
    return 0.5 * len(sample.y) * float(np.log(total))


def loglik(sample: Sample, theta: Array) -> float:
    """−½ (log|V| + yᵀPy) at θ, with the best coefficients: differences over θ and over X count."""
    return _of_the_rows(_state(sample.left, sample.basis, sample.effects, theta))


def _of_the_rows(s: _State) -> float:
    return s.loglik + 0.5 * float(np.linalg.slogdet(s.information)[1])


def reml_information(sample: Sample, theta: Array) -> Array:
    """(K, K) expected information on all variances at θ, those at zero too."""
    size = sample.effects.mean_sizes()
    scaled = sample.effects.scaled(1.0 / size)
    total = max(float(np.sum(theta * size)), 1e-300)
    state = _state(np.zeros(len(sample.y)), sample.basis, scaled, theta * size / total)
    _, information = _derivatives(state)
    return np.asarray(information * np.outer(size, size) / total**2)


@dataclass(frozen=True)
class _Scored:
    """Where the search ended. information: (K, K) the expected one; done: whether it settled there."""

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
    for _ in range(_MOST_STEPS):
        score, information = _slope(states, expected)
        step = _step(theta, score, information, sought)
        new, better = _improved(samples, theta, step, _total(states))
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


def _step(theta: Array, score: Array, information: Array, free: NDArray[np.bool_]) -> Array:
    """(K,) to the maximum of the quadratic sᵀd − ½ dᵀI d with θ + d >= 0: uphill, whatever is at its bound.

    Every variance in units of its own error, or a large one would count as unseen. Least squares with bounds:
    Lawson, Hanson, Solving Least Squares Problems, 1974, 23.
    """
    from scipy.optimize import nnls

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
    found, _ = nnls((vector * root).T, target, maxiter=30 * len(at))
    step[free] = np.minimum(found / unit, _MOST) - theta[free]
    return step


def _states(samples: Sequence[Sample], theta: Array) -> list[_State]:
    return [_state(s.y, s.X, s.effects, theta) for s in samples]


def _total(states: Sequence[_State]) -> float:
    return sum(s.loglik for s in states)


def _slope(states: Sequence[_State], expected: bool) -> tuple[Array, Array]:
    """Score (K,) and information (K, K) of all samples together."""
    parts = [_derivatives(s) if expected else _average_information(s) for s in states]
    return np.sum([p[0] for p in parts], axis=0), np.sum([p[1] for p in parts], axis=0)


def _improved(
    samples: Sequence[Sample], theta: Array, step: Array, now: float
) -> tuple[Array, list[_State] | None]:
    """The longest halved step that raises the likelihood; the noise keeps a tenth of what it was."""
    floor = np.where(np.arange(len(theta)) == 0, 0.1 * theta[0], 0.0)
    for halving in range(12):
        new = np.maximum(theta + step * 0.5**halving, floor)
        states = _states(samples, new)
        if np.isfinite(_total(states)) and _total(states) > now:
            return new, states
    return theta, None
