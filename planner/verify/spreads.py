"""Spreads that are estimates: in how many types of unit, each with its own true spreads, is the promise kept?

A spread s that was estimated from n power-ons says of the true one s² (n − 1) / χ²(n − 1). A type has one
such draw for every error; what its power-ons add, in the campaign and in flight, is that factor times what
those of the stated spread add. So the same units serve all types,

    d = d₀ + Σ_e (f_e − 1) d_e,     d_e by the run-to-run of error e alone

through the estimator and the linear combination of the flight, which the flights show to hold. What these
units err by their number they err in every type alike: of each type there is an interval as of any flights.
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
from planner.verify.outcome import TypesOutcome, Verdict, promised_share, rms_interval, share_interval

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
    """Of each type: (R, TYPES) flights within the limit, (R, TYPES, M) sums of |d|², |d|⁴ at each instant."""

    flights: int
    hits: Array
    squares: Array
    fourth: Array


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
    fourth = np.zeros_like(squares)
    for r, wanted in enumerate(e.requirements):
        for k, factors in enumerate(types.factors):
            d = nominal[r] + sum((f - 1.0) * one[r] for f, one in zip(factors, alone, strict=True))
            hits[r, k] = np.sum(lengths_of(d) <= wanted.limit.si)
            each = np.sum(d**2, axis=1)
            squares[r, k, : len(d)], fourth[r, k, : len(d)] = each.sum(axis=1), np.sum(each**2, axis=1)
    return TypeTally(flights, hits, squares, fourth)


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
        np.sum([t.fourth for t in tallies], axis=0),
    )


def judged(tally: TypeTally, index: int, wanted: Requirement, spec: Spec) -> TypesOutcome:
    """Whether the promise of a requirement is kept by as many types as the plan's confidence says.

    All types fly the same units: by how many of them it is kept is open by the types whose own interval has
    the promise in it, and by the number of the types.
    """
    promised = promised_share(wanted, spec)
    if promised is None:
        rms = (_rms(tally, index, k) for k in range(tally.squares.shape[1]))
        each = np.array([[wanted.limit.si - at for at in one] for one in rms])
    else:
        hits = tally.hits[index].astype(int).tolist()
        intervals = {n: share_interval(n, tally.flights) for n in set(hits)}
        each = np.array([[n / tally.flights, *intervals[n][::-1]] for n in hits]) - promised
    kept, possibly, surely = (int(n) for n in np.sum(each >= 0.0, axis=0))
    asked, of = spec.plan.confidence, len(each)
    low, high = share_interval(surely, of)[0], share_interval(possibly, of)[1]
    verdict: Verdict = "kept" if low >= asked else "broken" if high < asked else "undecided"
    return TypesOutcome(of, kept / of, low, high, asked, verdict)


def _rms(tally: TypeTally, index: int, k: int) -> tuple[float, float, float]:
    """Of type k, its least and its most, at the moment at which it is largest."""
    worst = int(np.argmax(tally.squares[index, k]))
    return rms_interval(tally.squares[index, k, worst], tally.fourth[index, k, worst], tally.flights)
