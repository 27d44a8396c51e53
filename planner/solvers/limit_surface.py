"""The surface on which the tightest of several constraints is just met, and how far one can go towards it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.sensitivities import Constraint
from planner.solvers.gaussian_length import COMPONENTS, exceedance, length_per_rms, percentile
from planner.solvers.linear_combination import covariance_per_unit, weights

Indices = NDArray[np.intp]

_EXACT = 1e-12  # relative accuracy of every figure that leaves the program
ROUNDING = 1e-9  # of a limit: who asks for just the nearest limit that can be met, as printed, shall get it
_SEARCH_STEPS = 200  # bisection alone needs 60 to exhaust a float; false position rarely needs 12


class LimitSurface:
    """All constraints together on E errors: load(ε) = max over constraints of value / limit.

    `tolerance` is the relative accuracy of percentiles and of `reach`; a search may want it coarser.
    Raises ValueError for a limit that is not positive.
    """

    def __init__(
        self, constraints: Sequence[Constraint], errors: Sequence[str], tolerance: float = _EXACT
    ) -> None:
        if any(constraint.limit <= 0 for constraint in constraints):
            raise ValueError("every limit must be positive")
        self.tolerance = tolerance
        self._sums = _relative_weights(constraints, errors, "worst_case")
        self._squares = _relative_weights(constraints, errors, "rss") ** 2
        self._gaussians = _relative_covariances(constraints, errors)

    def load(self, sizes: Array) -> Array:
        """(..., E) sizes -> (...) the largest share of a limit that is used; 1 on the surface."""
        sizes = np.asarray(sizes, dtype=float)
        sums = (sizes @ self._sums.T).max(axis=-1, initial=0.0)
        squares = np.sqrt((sizes**2 @ self._squares.T).max(axis=-1, initial=0.0))
        return np.asarray(np.maximum(np.maximum(sums, squares), self._gaussian_load(sizes)))

    def reach(self, base: Array, direction: Array, most: Array) -> Array:
        """The largest t in [0, most] with load(base + t·direction) <= 1: (..., E), (..., E), (...) -> (...).

        Base and direction are not negative, so the load grows along the ray; 0 if the base is beyond already.
        Closed form for worst_case and rss, bracketed search for percentiles.
        """
        nearest = np.minimum(self._linear_reach(base, direction), self._quadratic_reach(base, direction))
        nearest = np.asarray(np.minimum(nearest, most))
        for gaussian in self._gaussians:
            shape = (*nearest.shape, base.shape[-1])
            start, ray = (np.broadcast_to(a, shape).reshape(-1, shape[-1]) for a in (base, direction))
            far = gaussian.reach(start, ray, nearest.reshape(-1), self.tolerance)
            nearest = far.reshape(nearest.shape)
        return nearest

    def _linear_reach(self, base: Array, direction: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.maximum(1.0 - base @ self._sums.T, 0.0) / (direction @ self._sums.T)
        return np.asarray(np.where(np.isnan(t), 0.0, t).min(axis=-1, initial=np.inf))

    def _quadratic_reach(self, base: Array, direction: Array) -> Array:
        return np.asarray(_quadratic_root(base, direction, self._squares.T, 1.0).min(axis=-1, initial=np.inf))

    def _gaussian_load(self, sizes: Array) -> Array:
        loads = [gaussian.load(sizes, self.tolerance) for gaussian in self._gaussians]
        return np.max(loads, axis=0) if loads else np.zeros(sizes.shape[:-1])


@dataclass(frozen=True)
class _Gaussians:
    """All percentile constraints of one probability, in units of their limits.

    covariances: (E, R, 3, 3) per unit of each error; variances: (E, R) their traces
    least, most: bounds on percentile / sqrt(trace); they tell cheaply which constraints can matter
    """

    probability: float
    covariances: Array
    variances: Array
    least: float
    most: float

    def load(self, sizes: Array, tolerance: float) -> Array:
        """(..., E) -> (...) the largest percentile, in limits."""
        rms = np.sqrt(sizes**2 @ self.variances)
        matters = self.most * rms >= self.least * rms.max(axis=-1, keepdims=True)
        loads = np.zeros(rms.shape)
        covariances = np.tensordot(sizes**2, self.covariances, 1)[matters]
        loads[matters] = percentile(covariances, self.probability, tolerance)
        return np.asarray(loads.max(axis=-1))

    def reach(self, base: Array, direction: Array, nearest: Array, tolerance: float) -> Array:
        """(n, E), (n, E), (n,) -> (n,) the largest t <= nearest within all limits."""
        sure, beyond = (
            _quadratic_root(base, direction, self.variances, 1.0 / length**2)
            for length in (self.most, self.least)
        )
        low, high = (np.minimum(nearest, t.min(axis=-1)) for t in (sure, beyond))
        matters = sure <= high[:, None]

        def excess(t: Array, which: Indices) -> Array:
            return self._excess(base[which] + t[:, None] * direction[which], matters[which], tolerance)

        return _last_within(excess, low, high, tolerance)

    def _excess(self, sizes: Array, matters: NDArray[np.bool_], tolerance: float) -> Array:
        """(n,) negative inside the limits, zero on the tightest; asks for a probability, not a percentile.

        If one component were all, erfc⁻¹(1 − p) / erfc⁻¹(P(length > limit)) would be the load itself; it is
        near it otherwise, so that the search along a ray meets an almost straight line.
        """
        from scipy.special import erfcinv

        depth = np.full(matters.shape, np.inf)
        covariances = np.tensordot(sizes**2, self.covariances, 1)[matters]
        tail = exceedance(covariances, np.ones(len(covariances)), tolerance)
        depth[matters] = erfcinv(np.minimum(tail, 1.0 - 1e-15))
        return np.asarray(erfcinv(1.0 - self.probability) / depth.min(axis=-1) - 1.0)


def _quadratic_root(base: Array, direction: Array, squares: Array, limit: float) -> Array:
    """(..., R) the t with Σ_j s_jr (base_j + t direction_j)² = limit; 0 if the base is beyond.

    base, direction: (..., E); squares: (E, R).
    Root of A t² + 2B t = limit − C in the form that loses no digits; infinite where nothing grows.
    """
    a, b = direction**2 @ squares, (base * direction) @ squares
    rest = np.maximum(limit - base**2 @ squares, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = rest / (b + np.sqrt(b**2 + a * rest))
    return np.asarray(np.where(np.isnan(t), 0.0, t))


def binding(
    constraints: Sequence[Constraint], errors: Sequence[str], sizes: Array, tolerance: float = _EXACT
) -> list[Constraint]:
    """The constraints that are used most at one at least of the points `sizes` (N, E), in their order."""
    loads = [LimitSurface([constraint], errors, tolerance).load(sizes) for constraint in constraints]
    return [constraints[i] for i in np.unique(np.argmax(loads, axis=0))] if loads else []


def _relative_weights(constraints: Sequence[Constraint], errors: Sequence[str], rule: str) -> Array:
    """(R, E) weights in units of the limit."""
    rows = [weights(c, errors) / c.limit for c in constraints if c.rule == rule]
    return np.array(rows).reshape(-1, len(errors))


def _relative_covariances(constraints: Sequence[Constraint], errors: Sequence[str]) -> tuple[_Gaussians, ...]:
    """The percentile constraints, gathered by probability."""
    gaussian = sorted((c for c in constraints if c.rule == "percentile"), key=lambda c: c.probability)
    found = []
    for probability, group in groupby(gaussian, key=lambda c: c.probability):
        units = [_padded(covariance_per_unit(c, errors)) / c.limit**2 for c in group]
        covariances = np.stack(units, axis=1)
        variances = np.trace(covariances, axis1=2, axis2=3)
        found.append(_Gaussians(probability, covariances, variances, *length_per_rms(probability)))
    return tuple(found)


def _padded(covariances: Array) -> Array:
    missing = COMPONENTS - covariances.shape[-1]
    return np.pad(covariances, ((0, 0), (0, missing), (0, missing)))


def _last_within(
    excess: Callable[[Array, Indices], Array], low: Array, high: Array, tolerance: float
) -> Array:
    """The largest t in [low, high] with excess(t) <= 0, for an excess that grows: false position (Illinois).

    excess(t, which) is asked for the rays `which` that are still open. The search aims half the tolerance
    below zero, so what it returns is never beyond; `low` if that is beyond already. (n,), (n,) -> (n,)
    """
    aim = 0.5 * tolerance
    everything = np.arange(len(low))
    low, high = low.copy(), high.copy()
    at_low, at_high = excess(low, everything) + aim, excess(high, everything) + aim
    answer = np.where(at_high <= aim, high, low)
    which = everything[(at_low < -aim) & (at_high > aim)]
    last = np.zeros(len(low), dtype=int)  # the end that moved last: −1 low, +1 high
    for _ in range(_SEARCH_STEPS):
        if len(which) == 0:
            break
        middle = _chord(low[which], high[which], at_low[which], at_high[which])
        value = excess(middle, which) + aim
        inside, beyond = which[value <= 0], which[value > 0]
        # the end that stays twice running counts half, or it would stay for ever
        at_high[inside[last[inside] < 0]] *= 0.5
        at_low[beyond[last[beyond] > 0]] *= 0.5
        low[inside], at_low[inside], last[inside] = middle[value <= 0], value[value <= 0], -1
        high[beyond], at_high[beyond], last[beyond] = middle[value > 0], value[value > 0], 1
        accepted = value <= aim
        answer[which[accepted]] = middle[accepted]
        which = which[(np.abs(value) > aim) & (high[which] - low[which] > 1e-15 * high[which])]
    return answer


def _chord(low: Array, high: Array, at_low: Array, at_high: Array) -> Array:
    """Where the chord meets zero; the middle where there is no chord."""
    with np.errstate(divide="ignore", invalid="ignore"):
        zero = low - at_low * (high - low) / (at_high - at_low)
    return np.where((zero > low) & (zero < high), zero, 0.5 * (low + high))
