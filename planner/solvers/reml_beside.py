"""REML of models that lie apart by a few columns: a rough search, begun from one model's slope."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.nouns.array import Array
from planner.solvers.reml import MOST_STEPS, improved, in_units, step_within
from planner.solvers.restricted_likelihood import (
    Sample,
    State,
    average_information,
    loglik_of_rows,
    state_of,
)
from planner.solvers.triangles import inverse_of_triangle

_ROUNDING = 1e-13  # of a column's weight: what is left of one that is there already


@dataclass(frozen=True)
class Rough:
    """Where a rough search ended. theta: (K,); `restricted_loglik` there, and `loglik`, that of the rows."""

    theta: Array
    loglik: float
    of_the_rows: float


def reml_roughly(sample: Sample, start: Array, settled: float, first: Slope | None = None) -> Rough:
    """θ (K,) from a start by the average information alone: for models that lie apart.

    The search ends where a step gains less than `settled`; a component that is zero there may stay so.
    first: the likelihood at the start and its slope, where they are known
    """
    size, total = _units(sample, start)
    part, sought = in_units(sample, size, total), sample.effects.free
    theta = np.asarray(start * size / total)
    here = _slope_of(state_of(part.y, part.X, part.effects, theta)) if first is None else first
    loglik, of_the_rows = here.loglik, here.of_the_rows
    for _ in range(MOST_STEPS):
        step = step_within(theta, here.score, here.information, sought)
        new, better = improved([part], theta, step, loglik)
        if better is None:
            break
        gained = better[0].loglik - loglik
        theta, loglik, of_the_rows = new, better[0].loglik, loglik_of_rows(better[0])
        if gained < settled:
            break
        here = _slope_of(better[0])
    unit, n = 0.5 * float(np.log(total)), len(sample.y)
    left = n - sample.basis.shape[1]
    return Rough(np.asarray(theta * total / size), loglik - left * unit, of_the_rows - n * unit)


def promised(sample: Sample, theta: Array, more: int) -> Array:
    """(more,) what each of the last variances, zero at θ (K + more,), would gain beside the first K alone.

        2 max_d (sᵀd − ½ dᵀ I d),  θ + d ≥ 0,    less the same without it

    s, I score and average information there, of all of them for one likelihood: of 182 searches that followed
    none gained 2.7 times as much.
    """
    size, total = _units(sample, theta)
    part, at = in_units(sample, size, total), np.asarray(theta * size / total)
    slope = _slope_of(state_of(part.y, part.X, part.effects, at))
    own, sought = len(theta) - more, sample.effects.free

    def gain(some: list[int]) -> float:
        s, information = slope.score[some], slope.information[np.ix_(some, some)]
        step = step_within(at[some], s, information, sought[some])
        return float(2.0 * (s @ step) - step @ information @ step)

    first = list(range(own))
    return np.array([gain([*first, k]) for k in range(own, len(theta))]) - gain(first)


@dataclass(frozen=True)
class Slope:
    """What a search asks of one θ: the likelihoods of `restricted_loglik` and `loglik`, score, information.

    All of variances in units of `_units`; score (K,), information (K, K) the average one.
    """

    loglik: float
    of_the_rows: float
    score: Array
    information: Array


def _slope_of(s: State) -> Slope:
    return Slope(s.loglik, loglik_of_rows(s), *average_information(s))


@dataclass(frozen=True)
class Grounds:
    """One θ (K,) of a sample, from which models with a few columns more are asked for their slope there."""

    sample: Sample
    theta: Array

    @cached_property
    def _state(self) -> State:
        size, total = _units(self.sample, self.theta)
        part = in_units(self.sample, size, total)
        return state_of(part.y, part.X, part.effects, self.theta * size / total)

    @cached_property
    def _traces(self) -> Array:
        """(K,) tr P V_k."""
        s = self._state
        return s.v.traces - s.v.within(s.root)

    def with_columns(self, B: Array) -> Slope | None:
        """With more columns B (n, m) that are orthonormal beside those of the sample; None: hardly beside.

        P = V⁻¹ − root rootᵀ loses new newᵀ, new = P B L⁻ᵀ, L Lᵀ = Bᵀ P B: work of m columns, not of all.
        """
        s, rows = self._state, self.sample.effects.order_by_size
        B = B if rows is None else B[rows]
        VB = s.v.solve(B)
        PB = VB - s.root @ (s.root.T @ B)
        try:
            triangle = np.asarray(np.linalg.cholesky(B.T @ PB), dtype=float)
        except np.linalg.LinAlgError:
            return None
        if (np.diag(triangle) ** 2 <= _ROUNDING * np.einsum("nm,nm->m", B, VB)).any():
            return None
        new = PB @ inverse_of_triangle(triangle).T
        seen = new.T @ s.y
        Py = s.Py - new @ seen
        pulled = s.v.effects.pulled(Py)
        taken, own = s.root.T @ pulled, new.T @ pulled
        information = s.v.quadratic(pulled) - taken.T @ taken - own.T @ own
        explained, log = float(seen @ seen), 2.0 * float(np.log(np.diag(triangle)).sum())
        return Slope(
            s.loglik + 0.5 * (explained - log),
            loglik_of_rows(s) + 0.5 * explained,
            0.5 * (Py @ pulled - (self._traces - s.v.within(new))),
            0.5 * information,
        )


def _units(sample: Sample, start: Array) -> tuple[Array, float]:
    """(K,) the size of each variance's part and their sum at θ: a search goes in these."""
    size = sample.effects.mean_sizes()
    return size, float(np.sum(start * size))
