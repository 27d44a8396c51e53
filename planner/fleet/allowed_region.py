"""The allowed region of one unit's errors: every term of every error together, through every requirement.

A term is one coefficient of one channel, `gyro.bias x`. With residuals m_t and what a flight adds to each on
top, the reserve parts ρ_tp (run-to-run, in-run, …), the navigation error by the plan's own rules is

    worst_case   T = Σ_t ‖v_t‖ (|m_t| + Σ_p ρ_tp)
    rss          T² = Σ_t ‖v_t‖² (m_t² + Σ_p ρ_tp²)
    percentile   T = p-quantile of ‖N(0, Σ_t v_t v_tᵀ (m_t² + Σ_p ρ_tp²))‖

(theory, section 8), and the region is T <= limit for every constraint: convex, a rhombus in each plane.
Published coefficients hold for all axes together: a third of it (rss: of its square) is put on each axis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner import catalog
from planner.nouns.allowances import Allowance
from planner.nouns.array import Array, Rule
from planner.nouns.sensitivities import Constraint
from planner.nouns.sensor import ErrorName
from planner.solvers.gaussian_length import percentile

PARTS = ("run_to_run", "in_run", "storage", "temperature", "estimate")
ALL_AXES = "all"
_ENOUGH = 1e-6  # relative accuracy of a percentile: far below any measurement of a residual


@dataclass(frozen=True)
class RegionTerm:
    """One coefficient of one channel: `gyro.bias`, `x`; unit: display unit."""

    error: str
    term: str
    unit: str

    @property
    def name(self) -> str:
        """`gyro.bias x`."""
        return f"{self.error} {self.term}"

    @property
    def channel(self) -> str:
        """`gyro_x`: the sensor and the axis that the coefficient belongs to."""
        sensor = ErrorName(self.error).sensor
        return f"{sensor}_{self.term[0] if self.term != ALL_AXES else ALL_AXES}"


@dataclass(frozen=True)
class TermConstraint:
    """One requirement at one instant; vectors: (t, k) per SI unit of every term of the region."""

    requirement: int
    error: str
    unit: str
    rule: Rule
    limit: float
    time_s: float
    vectors: Array
    probability: float | None = None

    @cached_property
    def lengths(self) -> Array:
        """(t,) ‖v_t‖."""
        return np.asarray(np.linalg.norm(self.vectors, axis=1))

    @cached_property
    def steepest(self) -> Array:
        """(t,) no unit of a term can add more than this: ‖v_t‖, for a percentile z_p ‖v_t‖."""
        if self.probability is None or self.rule != "percentile":
            return self.lengths
        from scipy.special import erfinv

        return np.asarray(self.lengths * np.sqrt(2.0) * erfinv(self.probability))


@dataclass(frozen=True)
class AllowedRegion:
    """Terms, the constraints on them, and the parts of the plan's budget per term.

    parts: (t, 5) run_to_run, in_run, storage, temperature, estimate, SI; allowed: (t,) by the plan's rule
    split: whether published coefficients were divided over the axes
    """

    terms: tuple[RegionTerm, ...]
    constraints: tuple[TermConstraint, ...]
    parts: Array
    allowed: Array
    split: bool = False

    @cached_property
    def steepest(self) -> Array:
        """(t,) no unit of a term can add a larger share of any limit than this."""
        return np.asarray(np.max([c.steepest / c.limit for c in self.constraints], axis=0))

    @cached_property
    def power(self) -> int | None:
        """1: every share of a limit is a sum over the terms' sizes; 2: its square over their squares; None:
        neither."""
        rules = {c.rule for c in self.constraints}
        return {frozenset({"worst_case"}): 1, frozenset({"rss"}): 2}.get(frozenset(rules))

    @cached_property
    def weights(self) -> Array:
        """(c, t) of those sums: (‖v_t‖ / limit)^power."""
        return np.array([(c.lengths / c.limit) ** (self.power or 1) for c in self.constraints])

    def flown(self, reserve: Reserve) -> Array:
        """(…, t) what flights add to the terms of those sums."""
        return reserve.squares if self.power == 2 else reserve.sums

    def index(self, error: str, term: str) -> int | None:
        """Place of a term, None when the requirements do not know it."""
        for i, t in enumerate(self.terms):
            if t.error == error and t.term == term:
                return i
        return None

    def value(self, constraint: TermConstraint, residual: Array, reserve: Reserve) -> Array:
        """T in SI: residual (..., t) -> (...)."""
        if constraint.rule == "worst_case":
            return np.asarray((np.abs(residual) + reserve.sums) @ constraint.lengths)
        squares = residual**2 + reserve.squares
        if constraint.rule == "rss":
            return np.asarray(np.sqrt(squares @ constraint.lengths**2))
        return gaussian_percentile(constraint, squares)

    def load(self, residual: Array, reserve: Reserve) -> Array:
        """The largest share of a limit that is used: (..., t) -> (...)."""
        loads = [self.value(c, residual, reserve) / c.limit for c in self.constraints]
        return np.asarray(np.max(loads, axis=0))


@dataclass(frozen=True)
class Reserve:
    """What flights add to the residual of every term, SI: sums (..., t) of the parts, and of squares."""

    sums: Array
    squares: Array

    def __getitem__(self, row: int) -> Reserve:
        """The reserve of one row."""
        return Reserve(self.sums[row], self.squares[row])


def gaussian_percentile(constraint: TermConstraint, squares: Array) -> Array:
    """The p-quantile of the length for variances (..., t)."""
    outer = np.einsum("ti,tj->tij", constraint.vectors, constraint.vectors)
    covariance = np.tensordot(squares, outer, 1)
    if constraint.probability is None:
        raise ValueError("a percentile constraint has no probability")
    return percentile(np.asarray(covariance), constraint.probability, _ENOUGH)


def allowed_region(constraints: Sequence[Constraint], allowances: Sequence[Allowance]) -> AllowedRegion:
    """The region of the terms of all errors that have an allowance and that a requirement feels."""
    felt = [a for a in allowances if any(a.error in c.vectors for c in constraints)]
    terms = [RegionTerm(a.error, name, a.unit) for a in felt for name in _term_names(a.error)]
    parts = [tuple(a.parts.values()) for a in felt for _ in _term_names(a.error)]
    allowed = [a.allowed for a in felt for _ in _term_names(a.error)]
    split = any(
        len(np.atleast_2d(c.vectors[a.error])) != len(_term_names(a.error))
        for c in constraints
        for a in felt
        if a.error in c.vectors
    )
    return AllowedRegion(
        tuple(terms),
        tuple(_term_constraint(c, felt) for c in constraints),
        np.array(parts, dtype=float).reshape(-1, len(PARTS)),
        np.array(allowed, dtype=float),
        split,
    )


def _term_names(error: str) -> tuple[str, ...]:
    sensor, effect = ErrorName(error).parts
    return tuple(term.name for term in catalog.effects()[effect].terms(sensor))


def _term_constraint(c: Constraint, allowances: Sequence[Allowance]) -> TermConstraint:
    vectors = np.concatenate([_vectors(c, a.error) for a in allowances])
    return TermConstraint(c.requirement, c.error, c.unit, c.rule, c.limit, c.time_s, vectors, c.percentile)


def _vectors(c: Constraint, error: str) -> Array:
    """(terms, k) of an error; one vector for all axes is shared out so that equal errors give it back."""
    count = len(_term_names(error))
    size = next(iter(np.atleast_2d(v).shape[1] for v in c.vectors.values()))
    given = np.atleast_2d(c.vectors.get(error, np.zeros((count, size))))
    if len(given) == count:
        return given
    share = count if c.rule == "worst_case" else np.sqrt(count)
    return np.repeat(given / share, count, axis=0)


def reserve_of(region: AllowedRegion, kept: Mapping[str, Array] | Array) -> Reserve:
    """The reserve from which parts are kept: (..., t, 5) shares, 0 or 1, of every part of every term."""
    shares = np.asarray(kept, dtype=float)
    used = region.parts * shares
    return Reserve(used.sum(axis=-1), (used**2).sum(axis=-1))
