"""Spreads that are estimates: in how many types of unit, each with its own true spreads, is the promise kept?

A spread s that was estimated from n power-ons says of the true one s² (n − 1) / χ²(n − 1). A type has one
such draw for every error; what its power-ons add, in the campaign and in flight, is that factor times what
those of the stated spread add. So the same units serve all types,

    d = d₀ + Σ_e (f_e − 1) d_e,     d_e by the run-to-run of error e alone

through the estimator and the linear combination of the flight, which the flights show to hold.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.nouns.array import Array
from planner.protocols import SENSORS, Sensor
from planner.spec.budget import ErrorBudget
from planner.spec.model import Requirement, Spec
from planner.spec.references import BenchAccuracy
from planner.verify.chance import Chance
from planner.verify.draws import Unit, generator
from planner.verify.experiment import Experiment, units_left
from planner.verify.flights import exact_coefficients, lengths_of, vectors_of
from planner.verify.outcome import TypesOutcome, Verdict, promised_share, share_interval

SPREADS = ("stated", "drawn")
TYPES = 400  # a share of 95 % of them is known to 2 %
Error = tuple[Sensor, str]


@dataclass(frozen=True)
class Types:
    """Errors whose spread is an estimate, and (TYPES, E) the factors of the true ones."""

    errors: tuple[Error, ...]
    factors: Array


@dataclass(frozen=True)
class Typed:
    """An experiment with the types that its units may be of."""

    e: Experiment
    types: Types


@dataclass(frozen=True)
class TypeTally:
    """Of each type: (R, TYPES) flights within the limit, (R, TYPES, M) sums of |d|² at each instant."""

    flights: int
    hits: Array
    squares: Array


def types_of(spec: Spec, seed: int) -> Types:
    """Drawn from the spec's numbers of power-ons; without any there are no errors in it."""
    known: dict[Error, ErrorBudget] = {(s, e): b for s in SENSORS for e, b in getattr(spec.unit, s).items()}
    errors = tuple(error for error, budget in known.items() if budget.power_ons is not None)
    factors = np.ones((TYPES, len(errors)))
    for i, error in enumerate(errors):
        freedom = float((known[error].power_ons or 2) - 1)
        factors[:, i] = np.sqrt(freedom / generator(seed, 0, "spread", *error).chisquare(freedom, size=TYPES))
    return Types(errors, factors)


def run_types(shared: Typed, number: int, flights: int) -> TypeTally:
    """One chunk's units, as of every type."""
    e, types = shared.e, shared.types
    assert e.flight is not None
    beside = e.flight.beside.drawn(e.flight.trajectory, flights, (e.seed, number))
    nominal = _vectors(e, number, flights, beside)
    alone = [_vectors(_only(e, error), number, flights, {}) for error in types.errors]
    hits = np.zeros((len(e.requirements), len(types.factors)))
    squares = np.zeros((*hits.shape, max(len(v) for v in nominal)))
    for r, wanted in enumerate(e.requirements):
        for k, factors in enumerate(types.factors):
            d = nominal[r] + sum((f - 1.0) * one[r] for f, one in zip(factors, alone, strict=True))
            hits[r, k] = np.sum(lengths_of(d) <= wanted.limit.si)
            squares[r, k, : len(d)] = np.sum(d**2, axis=(1, 2))
    return TypeTally(flights, hits, squares)


def _vectors(e: Experiment, number: int, flights: int, beside: Mapping[str, Array]) -> list[Array]:
    """(k, c, B) of every requirement by the linear combination, with what flies beside the errors."""
    assert e.flight is not None
    coefficients = exact_coefficients(e.flight, units_left(e, number, flights), beside)
    return [
        vectors_of(e.flight.linear, e.flight.instants, wanted) @ coefficients.T for wanted in e.requirements
    ]


def _only(e: Experiment, error: Error) -> Experiment:
    """The same units with nothing but the power-ons' draws of one error, on perfect benches."""
    budgets = {
        other: ErrorBudget(run_to_run=budget.run_to_run) if other == error else ErrorBudget()
        for other, budget in e.unit.budgets.items()
    }
    perfect = {
        name: bench.model_copy(update={"accuracy": BenchAccuracy()}) for name, bench in e.spec.benches.items()
    }
    still = Chance(white=dict.fromkeys(SENSORS, 0.0), temperature_jitter=0.0)
    spec = e.spec.model_copy(update={"benches": perfect})
    return replace(e, unit=Unit(budgets, {}), chance=still, spec=spec)


def total(tallies: Sequence[TypeTally]) -> TypeTally:
    """All chunks as one."""
    return TypeTally(
        sum(t.flights for t in tallies),
        np.sum([t.hits for t in tallies], axis=0),
        np.sum([t.squares for t in tallies], axis=0),
    )


def judged(tally: TypeTally, index: int, wanted: Requirement, spec: Spec) -> TypesOutcome:
    """Whether the promise of a requirement is kept by as many types as the plan's confidence says."""
    promised = promised_share(wanted, spec)
    if promised is None:
        kept = tally.squares[index].max(axis=1) / tally.flights <= wanted.limit.si**2
    else:
        kept = tally.hits[index] / tally.flights >= promised
    count, asked = int(np.sum(kept)), spec.plan.confidence
    low, high = share_interval(count, len(kept))
    verdict: Verdict = "kept" if low >= asked else "broken" if high < asked else "undecided"
    return TypesOutcome(len(kept), count / len(kept), low, high, asked, verdict)
