"""Accepted, rejected or undecided: two one-sided tests with stated error rates.

A unit is good when T_c(m) <= L_c for every constraint c, its residual m being estimated as m̂ ~ N(m, C).

Bad accepted, at most β. The good residuals are a convex set, so a plane with normal g parts it from a bad m.
Accepted is m̂ when the whole ellipsoid {m̂ + u: uᵀC⁻¹u <= z_β²} is good; then gᵀ(m̂ − m) <= −z_β √(gᵀCg), which
has the probability β at most. With G = diag ‖v‖, S = GCG, its eigenvalues μ_i, b the parts of Gm̂ along them

    worst_case   max T <= T(m̂) + z_β √(Σ_st |S_st|)                         (exact without correlations)
    rss          max T² = T² + min over λ > μ of Σ μ_i b_i²/(λ − μ_i) + λ z_β²     (Lagrange; S-lemma: exact)
    percentile   the same with G = z_p diag ‖v‖, z_p² ‖v‖² bounding the slope of T² in m_t² for p >= 0.88
                 (Székely, Bakirov, Probab. Theory Relat. Fields 126, 2003, 184), S by a larger diagonal

or T(m̂) + z_β √μ_max where that is less. Passing all constraints needs no correction (intersection–union).

Good rejected, at most α. T(m̂) lies above T(m) on average, |m̂_t| being at least zero. With every m_t in
m̂_t ± kσ_t (probability 1 − γ, γ = α/10) and a_t its end nearest to zero, for m̂_t > 0

    |m̂_t| − |m_t| <= max(e_t, −e_t − 2 a_t),       e = m̂ − m ~ N(0, C)

so T exceeds L by more than the (1 − α + γ) quantile of Σ ‖v_t‖ max(e_t, −e_t − 2a_t) with at most α
(Berger, Boos, J. Am. Stat. Assoc. 89, 1994, 1012); otherwise T − T(m) <= (gᵀe + eᵀG²e / 2L) with moments from
G C G. One constraint of many suffices to reject, so α is shared by them (Bonferroni).
An estimated spread takes Student's t for z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner.errors import InputError
from planner.fleet.allowed_region import AllowedRegion, Reserve, TermConstraint
from planner.fleet.check_residual import MeasuredResidual
from planner.nouns.array import Array
from planner.solvers.distributions import student_quantile

Verdict = Literal["accepted", "rejected", "undecided"]
DRAWS = 4000
_SIMULATED_LEVEL = 0.01  # quantiles further out are scaled from here: 4000 draws hold 40 beyond it
_SEED = 20240731
MOST_RECORDS = 100_000
_OF_ONE_TERM = 0.88  # of a percentile: from here on a single term has the longest tail for its variance
_HALVINGS = 50


@dataclass(frozen=True)
class ErrorRates:
    """Probabilities that a decision may be wrong: a good unit rejected, a bad unit accepted."""

    good_rejected: float = 0.05
    bad_accepted: float = 0.05

    def __post_init__(self) -> None:
        for name, value in (("good rejected", self.good_rejected), ("bad accepted", self.bad_accepted)):
            if not 0.0 < value < 0.5:
                raise InputError(f"the rate of {name} must lie between 0 and 50 %, not {100 * value:g} %")


@dataclass(frozen=True)
class Judgement:
    """One group of records against every constraint, SI of the constraint: all (c,).

    value: T(m̂); limit; to_accept: how far below the limit it must stay; to_reject: how far above
    """

    value: Array
    limit: Array
    to_accept: Array
    to_reject: Array

    @property
    def verdict(self) -> Verdict:
        """By every constraint."""
        if np.any(self.value - self.limit > self.to_reject):
            return "rejected"
        return "accepted" if np.all(self.value + self.to_accept <= self.limit) else "undecided"

    @property
    def load(self) -> Array:
        """(c,) shares of the limits."""
        return np.asarray(self.value / self.limit)

    @property
    def binding(self) -> int:
        """The constraint that is nearest to its limit, or furthest beyond it."""
        return int(np.argmax(self.value / self.limit))

    def needed(self) -> float:
        """Times as many records as there are that would decide, if the residual is what it seems.

        Both margins shrink as 1/√n: n / n₀ = (margin / distance)².
        """
        distance = self.limit - self.value
        inside = np.all(distance > 0)
        with np.errstate(divide="ignore"):
            if inside:
                return float(np.max((self.to_accept / np.maximum(distance, 1e-300)) ** 2))
            over = distance < 0
            return float(np.min((self.to_reject[over] / distance[over]) ** 2)) if over.any() else np.inf


def judged(
    region: AllowedRegion,
    found: MeasuredResidual,
    value: Array,
    rates: ErrorRates,
    groups: int = 1,
) -> Judgement:
    """One group of records; value: (c,) T(m̂); groups: how many of the unit can each reject it."""
    limit = np.array([c.limit for c in region.constraints])
    alpha = rates.good_rejected / (len(limit) * max(groups, 1))
    accept = np.array(
        [
            to_accept(c, found, found.residual, v, rates.bad_accepted)
            for c, v in zip(region.constraints, np.asarray(value, dtype=float), strict=True)
        ]
    )
    reject = np.zeros_like(value)
    for i, c in enumerate(region.constraints):
        # below the limit nothing rejects, and the margin is only needed to foretell records
        reject[i] = _to_reject(c, found, alpha) if value[i] > limit[i] else accept[i]
    return Judgement(value, limit, accept, reject)


def quantile(found: MeasuredResidual, level: float) -> float:
    """The one-sided quantile beyond which `level` lies: normal, Student's t for an estimated spread."""
    return float(-student_quantile(level, found.freedom))


def _scaled(c: TermConstraint, found: MeasuredResidual) -> Array:
    """G C G in (SI of the constraint)²."""
    return np.asarray(found.covariance * np.outer(c.steepest, c.steepest))


def to_accept(
    c: TermConstraint, found: MeasuredResidual, residual: Array, value: Array, beta: float
) -> Array:
    """(...) how far T = value (...) must stay below the limit for residuals (..., t) as well measured."""
    scaled, z = _scaled(c, found), quantile(found, beta)
    if c.rule == "worst_case":
        return np.full(np.shape(value), z * float(np.sqrt(np.abs(scaled).sum())))
    steepest = z * np.sqrt(max(float(np.linalg.eigvalsh(scaled)[-1]), 0.0))
    if c.rule == "percentile":
        if (c.probability or 0.0) < _OF_ONE_TERM:
            return np.full(np.shape(value), steepest)
        scaled = np.diag(np.abs(scaled).sum(axis=1))  # no smaller: its difference dominates by rows
    further = np.sqrt(value**2 + _further_squared(scaled, c.steepest * residual, z)) - value
    return np.asarray(np.minimum(steepest, further))


def _further_squared(scaled: Array, size: Array, z: float) -> Array:
    """(...) the most by which ‖size + y‖² exceeds ‖size‖² for yᵀS⁻¹y <= z²; every λ gives a bound."""
    mu, axes = np.linalg.eigh(scaled)
    mu = np.maximum(mu, 0.0)
    along = mu * (size @ axes) ** 2
    low = np.zeros(np.shape(size)[:-1])
    high = np.sqrt(along.sum(axis=-1)) / z
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        gap = np.maximum(mu[-1] - mu + middle[..., None], 1e-300)
        over = (along / gap**2).sum(axis=-1) > z**2
        low, high = np.where(over, middle, low), np.where(over, high, middle)
    gap = np.maximum(mu[-1] - mu + high[..., None], 1e-300)
    return np.asarray((along / gap).sum(axis=-1) + (mu[-1] + high) * z**2)


def _to_reject(c: TermConstraint, found: MeasuredResidual, alpha: float) -> float:
    scaled = _scaled(c, found)
    if c.rule == "worst_case":
        return _folded_quantile(c, found, scaled, alpha)
    slope = np.sqrt(max(float(np.linalg.eigvalsh(scaled)[-1]), 0.0))
    bend, rough = np.trace(scaled) / (2 * c.limit), np.sqrt(2 * np.sum(scaled**2)) / (2 * c.limit)
    return float(bend + quantile(found, alpha) * np.hypot(slope, rough))


def _folded_quantile(c: TermConstraint, found: MeasuredResidual, scaled: Array, alpha: float) -> float:
    """The (1 − α + γ) quantile of Σ ‖v_t‖ max(e_t, −e_t − 2a_t), by simulation with a fixed seed."""
    sure = 0.1 * alpha
    sigma = np.sqrt(np.diag(scaled))
    seen = np.flatnonzero(sigma > 0)
    if len(seen) == 0:
        return 0.0
    k = quantile(found, sure / (2 * len(seen)))
    size = np.abs(found.residual) * c.steepest
    nearest = np.maximum(size - k * sigma, 0.0)[seen]
    sign = np.where(found.residual[seen] < 0, -1.0, 1.0)
    draws = _errors(scaled[np.ix_(seen, seen)], found.freedom) * sign
    total = np.maximum(draws, -draws - 2 * nearest).sum(axis=1)
    level = alpha - sure
    there = max(level, _SIMULATED_LEVEL)
    return float(np.quantile(total, 1 - there)) * quantile(found, level) / quantile(found, there)


def _errors(covariance: Array, freedom: float) -> Array:
    """(DRAWS, t) errors of the estimates."""
    rng = np.random.default_rng(_SEED)
    values, vectors = np.linalg.eigh(covariance)
    normal = rng.standard_normal((DRAWS, len(values))) * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    if np.isinf(freedom):
        return np.asarray(normal)
    return np.asarray(normal / np.sqrt(rng.chisquare(freedom, DRAWS) / freedom)[:, None])


def room_left(region: AllowedRegion, residual: Array, reserve: Reserve, worst: Sequence[int]) -> Array:
    """(t,) how large each |m_t| may be while the others stay as measured, SI; 0 where nothing is left.

    worst: constraints to look at. Exact for worst_case and rss; a percentile takes z_p ‖v_t‖ as its slope at
    most, so the room is never overstated.
    """
    rooms = [_room(region, region.constraints[i], residual, reserve) for i in worst]
    return np.asarray(np.min(rooms, axis=0))


def _room(region: AllowedRegion, c: TermConstraint, residual: Array, reserve: Reserve) -> Array:
    value = float(region.value(c, residual, reserve))
    slope = c.steepest
    felt = slope > 0
    safe = np.where(felt, slope, 1.0)
    if c.rule == "worst_case":
        left = np.abs(residual) + (c.limit - value) / safe
    else:
        square = residual**2 + (c.limit**2 - value**2) / safe**2
        left = np.sqrt(np.maximum(square, 0.0))
    return np.asarray(np.where(felt, np.maximum(left, 0.0), np.inf))
