"""Spreads that are estimates: by how much the promise must be kept, to be kept with the asked confidence.

A run-to-run spread s estimated from n power-ons leaves the true one open: s_true² = s² κ, κ = ν/χ²_ν,
ν = n − 1 (with the prior that knows nothing of its size). The square of a figure is nearly linear in every
κ, because every spread adds to the variance of d, in flight and through the estimates:

    F²(κ) ≈ F² + Σ_e (κ_e − 1) ∂F²/∂κ_e

so that the load L = max_k F_k/limit_k is drawn over all spreads jointly in no time. The factor is its
quantile at `plan.confidence` over what it is at the stated spreads.
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


def spread_factor(flight: Flight, visits: Sequence[TestVisits]) -> float:
    """By what the load is multiplied to hold with `plan.confidence`; 1 if all spreads are known."""
    spreads = estimated_spreads(flight.spec)
    if not spreads:
        return 1.0

    def squares(spec: Spec) -> Array:
        return np.asarray((figures_with(flight, visits, spec).max(axis=0) / flight.limits) ** 2)

    stated = squares(flight.spec)
    slopes = [squares(scaled(flight.spec, s.error, TWICE, ("run_to_run",))) - stated for s in spreads]
    rng = np.random.default_rng(flight.spec.plan.seed)
    freedom = np.array([s.power_ons - 1 for s in spreads])
    kappa = freedom / rng.chisquare(freedom, size=(DRAWS, len(spreads)))
    loads = np.sqrt(np.maximum(stated + (kappa - 1.0) @ np.array(slopes), 0.0).max(axis=1))
    found = float(np.quantile(loads, flight.spec.plan.confidence) / np.sqrt(stated.max()))
    return max(found, 1.0)


def figures_with(flight: Flight, visits: Sequence[TestVisits], spec: Spec) -> Array:
    """(families, requirements) figures of visits under an error model, quickly, SI."""
    kinds = kinds_of(spec, [(v.test, v.temperatures_degc) for v in visits])
    other = flight.under(spec)
    promise = promise_of(other, kinds, asked_of(other, exact=False))
    made = {(v.test, t): n for v in visits for t, n in zip(v.temperatures_degc, v.repeats, strict=True)}
    counts = np.array([[float(made[k.test, k.temperature_degc]) for k in kinds.kinds]])
    return np.asarray(promise.figures(counts)[0])
