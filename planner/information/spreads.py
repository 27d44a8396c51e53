"""Spreads that are estimates: by how much limits must be kept, to be kept with the asked confidence.

A run-to-run spread s estimated from n power-ons leaves the true one open: s_true² = s² κ, κ = ν/χ²_ν,
ν = n − 1 (with the prior that knows nothing of its size). The square of a figure is nearly linear in every
κ, because every spread adds to the variance of d, in flight and through the estimates:

    F²(κ) ≈ F² + Σ_e (κ_e − 1) ∂F²/∂κ_e

so that F_k(κ)/F_k is drawn for all requirements k jointly in no time. The factor of each is its quantile at
one level for all, at which all hold together with `plan.confidence` (simultaneous quantiles). It goes by no
limit: what is kept easily needs no room of what is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.information.kinds import kinds_of
from planner.information.model_of import Flight, asked_of, promise_of
from planner.information.scaled import scaled
from planner.nouns.array import Array
from planner.nouns.choices import TestVisits
from planner.nouns.sensor import ErrorName
from planner.protocols import SENSORS
from planner.spec.model import Spec

DRAWS = 20_000
TWICE = float(np.sqrt(2.0))  # of a spread: its square is twice as large


@dataclass(frozen=True)
class Estimated:
    """A spread that is an estimate, and from how many power-ons."""

    error: ErrorName
    power_ons: int


def estimated_spreads(spec: Spec) -> tuple[Estimated, ...]:
    """The run-to-run spreads that the spec gives as estimates."""
    return tuple(
        Estimated(ErrorName.of(sensor, effect), budget.power_ons)
        for sensor in SENSORS
        for effect, budget in getattr(spec.unit, sensor).items()
        if budget.power_ons is not None and budget.run_to_run_largest > 0
    )


def spread_factors(flight: Flight, visits: Sequence[TestVisits]) -> Array:
    """(requirements,) times which figures hold with `plan.confidence`; 1 where spreads are known."""
    spec = flight.spec
    spreads = estimated_spreads(spec)
    if not spreads:
        return np.ones(len(spec.requirement))

    def squares(other: Spec) -> Array:
        return np.asarray(figures_with(flight, visits, other).max(axis=0) ** 2)

    stated = squares(spec)
    found, told = np.ones(len(stated)), np.isfinite(stated) & (stated > 0.0)
    larger = [squares(scaled(spec, s.error, TWICE, ("run_to_run",))) for s in spreads]
    slopes = [each[told] / stated[told] - 1.0 for each in larger]
    rng = np.random.default_rng(spec.plan.seed)
    freedom = np.array([s.power_ons - 1 for s in spreads])
    kappa = freedom / rng.chisquare(freedom, size=(DRAWS, len(spreads)))
    ratios = np.sqrt(np.maximum(1.0 + (kappa - 1.0) @ np.array(slopes), 0.0))
    if told.any():
        found[told] = np.maximum(simultaneous(ratios, spec.plan.confidence), 1.0)
    return found


def simultaneous(drawn: Array, share: float) -> Array:
    """(k,) quantiles at one level, within all of which together lies a share of draws (n, k)."""
    ordered = np.sort(drawn, axis=0)
    # of equals the first place: what does not vary is within any level
    ranks = [1 + np.searchsorted(own, each) for own, each in zip(ordered.T, drawn.T, strict=True)]
    level = np.quantile(np.max(ranks, axis=0), share, method="higher")
    return np.asarray(ordered[int(level) - 1])


def figures_with(flight: Flight, visits: Sequence[TestVisits], spec: Spec) -> Array:
    """(families, requirements) figures of visits under an error model, quickly, SI."""
    other = flight.under(spec)
    kinds = kinds_of(spec, [(v.test, v.temperatures_degc) for v in visits], other.curves)
    promise = promise_of(other, kinds, asked_of(other, exact=False))
    made = {(v.test, t): n for v in visits for t, n in zip(v.temperatures_degc, v.repeats, strict=True)}
    counts = np.array([[float(made[k.test, k.temperature_degc]) for k in kinds.kinds]])
    return np.asarray(promise.figures(counts)[0])
