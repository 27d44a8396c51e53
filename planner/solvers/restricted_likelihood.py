"""The restricted likelihood of random effects' variances θ, with its slope and information.

    −½ (log|V| + log|XᵀV⁻¹X| + yᵀPy),   P = V⁻¹ − V⁻¹X (XᵀV⁻¹X)⁻¹ XᵀV⁻¹

X enters through an orthonormal basis of its columns, so that the inverse of XᵀV⁻¹X is one of a
well-conditioned matrix however ill-conditioned X is. Source: Patterson, Thompson, Biometrika 58 (1971) 545.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.nouns.array import Array
from planner.solvers.block_covariance import BlockCovariance
from planner.solvers.least_squares import factors
from planner.solvers.random_effects import Covariance, RandomEffects, covariance
from planner.solvers.triangles import inverse_of_triangle, times_transposed


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

    @cached_property
    def by_size(self) -> Sample:
        """`left` and the basis with groups of one size together: what a search asks a hundred times."""
        rows = self.effects.order_by_size
        if rows is None:
            return Sample(self.left, self.basis, self.effects, True)
        return Sample(self.left[rows], self.basis[rows], self.effects.by_size(), True)


@dataclass(frozen=True)
class State:
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
            return inverse_of_triangle(self.factor)
        return _inverse_root(self.information)

    @cached_property
    def root(self) -> Array:
        """(n, r) V⁻¹X halfᵀ: P = V⁻¹ − root rootᵀ."""
        return self.v.solve(self._halved())

    def _halved(self) -> Array:
        """(n, r) X halfᵀ."""
        if self.factor is None:
            return np.asarray(self.X @ self.half.T)
        return times_transposed(self.X, self.half)

    @cached_property
    def Py(self) -> Array:
        """(n,) V⁻¹ of what generalised least squares leaves of y."""
        left = self.y - self.X @ (self.half.T @ (self.half @ self.h))
        return self.v.solve(left[:, None])[:, 0]


def state_of(y: Array, X: Array, effects: RandomEffects, theta: Array) -> State:
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
    return State(v, y, X, information, h, factor, -0.5 * (v.log_determinant + log))


def _inverse_root(information: Array) -> Array:
    """(r, r) half with halfᵀ half the inverse; of the positive part where it is not positive definite."""
    try:
        return inverse_of_triangle(np.asarray(np.linalg.cholesky(information), dtype=float))
    except np.linalg.LinAlgError:
        value, vector = np.linalg.eigh((information + information.T) / 2.0)
        seen = value > max(float(value[-1]), 0.0) * np.finfo(float).eps
        return np.asarray((vector[:, seen] / np.sqrt(value[seen])).T)


def derivatives(s: State) -> tuple[Array, Array]:
    """Score (K,) and expected information (K, K): traces of V_k and P = V⁻¹ − root rootᵀ."""
    trace = s.v.traces - s.v.within(s.root)
    return 0.5 * (_quadratics(s) - trace), _expected_information(s)


def _expected_information(s: State) -> Array:
    """(K, K) ½ tr P V_k P V_l."""
    return np.asarray(0.5 * s.v.double_traces() - s.v.between(s.root))


def _quadratics(s: State) -> Array:
    """(K,) yᵀPV_kPy."""
    return np.asarray(s.Py @ s.v.effects.pulled(s.Py))


def average_information(s: State) -> tuple[Array, Array]:
    """Score (K,) and average information (K, K), ½ yᵀPV_kPV_lPy (Gilmour, Thompson, Cullis 1995).

    As good a curvature for the search as the expected one, for K products of matrices in place of K².
    """
    pulled = s.v.effects.pulled(s.Py)
    taken = s.root.T @ pulled
    trace = s.v.traces - s.v.within(s.root)
    information = s.v.quadratic(pulled) - taken.T @ taken
    return 0.5 * (s.Py @ pulled - trace), 0.5 * information


def restricted_loglik(sample: Sample, theta: Array) -> float:
    """−½ (log|V| + log|QᵀV⁻¹Q| + yᵀPy) at θ, Q an orthonormal basis of X: differences over θ count."""
    return state_of(sample.left, sample.basis, sample.effects, theta).loglik


def loglik(sample: Sample, theta: Array) -> float:
    """−½ (log|V| + yᵀPy) at θ, with the best coefficients: differences over θ and over X count."""
    return loglik_of_rows(state_of(sample.left, sample.basis, sample.effects, theta))


def loglik_of_rows(s: State) -> float:
    """−½ (log|V| + yᵀPy) of a state."""
    if s.factor is None:
        return s.loglik + 0.5 * float(np.linalg.slogdet(s.information)[1])
    return s.loglik + float(np.log(np.diag(s.factor)).sum())


def reml_information(sample: Sample, theta: Array) -> Array:
    """(K, K) expected information on all variances at θ, those at zero too."""
    size = sample.effects.mean_sizes()
    scaled = sample.effects.scaled(1.0 / size)
    total = max(float(np.sum(theta * size)), 1e-300)
    state = state_of(sample.left, sample.basis, scaled, theta * size / total)
    return _expected_information(state) * np.outer(size, size) / total**2
