"""What is left of every error in flight, part by part, and which error makes how much of each requirement.

Marginal sigmas of each error's largest term, root mean square over the flight's temperatures: the flight's
own power-on and drift; `storage`, the walk in store after the campaign; `estimate`, what noise, references
(a thermometer with what it makes of the curves) and the walk during the campaign leave of the coefficients as
they are at its end, and the constants of errors that no effect is declared for; `temperature`, what tables
miss of the curves. The covariance of all terms stands beside them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from planner.campaign.noise import budget_of
from planner.information.exact import Foreseen
from planner.information.in_flight import Asked, collapsed, drawn_by_flights, drawn_in_flight
from planner.information.model_of import Flight
from planner.information.promise import Promise
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.plan.flight_response import Flying

PARTS = ("run_to_run", "in_run", "storage", "temperature", "estimate")
ROUNDING = 1e-12  # of a variance


@dataclass(frozen=True)
class Left:
    """What is left of the F terms that fly. parts: error with a budget -> part -> sigma, SI

    covariance: (F, F) of all terms with everything in it, mean over the flight's temperatures
    """

    flying: tuple[Flying, ...]
    parts: Mapping[ErrorName, Mapping[str, float]]
    covariance: Array


def left_in_flight(flight: Flight, found: Foreseen, requirement: int) -> Left:
    """The parts of every error at the temperatures of a requirement, under the family that binds it."""
    promise = found.promise
    a = promise.asked[requirement]
    weights = _weights(a)
    each = _each_term(a, len(promise.flying))
    family = found.binding(requirement)
    noise, whole = (
        np.tensordot(weights, _left(p, each, found.counts), 1)
        for p in (promise.under(family, {}), promise.under(family))
    )
    own = {f: _own(flight, f, a, weights, found.days) for f in promise.flying}
    variances = {
        f: {
            "run_to_run": own[f]["run_to_run"],
            "in_run": own[f]["in_run"],
            "storage": own[f]["storage"],
            "temperature": _above(whole[i, i], noise[i, i]),
            "estimate": max(noise[i, i], 0.0),
        }
        for i, f in enumerate(promise.flying)
    }
    total = whole + np.diag([sum(own[f].values()) + _untold(flight, promise, f) for f in promise.flying])
    parts = {}
    for error in dict.fromkeys(f.error for f in promise.flying if f.error not in promise.unbudgeted):
        mine = [variances[f] for f in promise.flying if f.error == error]
        largest = max(mine, key=lambda v: sum(v.values()))
        parts[error] = {p: float(np.sqrt(largest[p])) for p in PARTS}
    return Left(promise.flying, parts, np.asarray(total))


def _untold(flight: Flight, promise: Promise, f: Flying) -> float:
    """Variance of a constant that no record tells, because no temperature of use reaches it.

    Of an error of which nothing is fitted every constant counts already.
    """
    budget, whole = budget_of(flight.spec.unit, f.error), f.error.parts in promise.constants
    known = budget is None or whole or f.term not in promise.unread.get(f.error, ())
    return 0.0 if budget is None or known else budget.systematic_size**2 / 3.0


def _above(whole: float, noise: float) -> float:
    """The rest of a variance; what rounding leaves of it is nothing."""
    rest = whole - noise
    return float(rest) if rest > ROUNDING * whole else 0.0


def left_by_campaign(promise: Promise, counts: Array, requirement: int, family: str) -> Array:
    """(F,) variances of what counts (g,) leave of every term, the flight's own draws left out, SI²."""
    a = promise.asked[requirement]
    left = _left(promise.under(family), _each_term(a, len(promise.flying)), counts[None])
    return np.asarray(np.diagonal(np.tensordot(_weights(a), left, 1)))


def _weights(a: Asked) -> Array:
    """(S,) of the flight's temperatures; where the worst counts, of a mean over the range.

    These lie from end to end: each stands for what is around it, half the way to its neighbours.
    """
    if a.weights is not None:
        return a.weights
    degc = a.temperature_degc[:, 0]
    apart = np.diff(degc, prepend=degc[:1], append=degc[-1:])
    return np.asarray((apart[:-1] + apart[1:]) / (2.0 * np.ptp(degc)))


def _left(promise: Promise, a: Asked, counts: Array) -> Array:
    """(S, F, F) what a campaign leaves of what is asked, under the only family."""
    [covariance], _ = replace(promise, asked=(a,)).covariances(counts)
    return np.asarray(covariance[0, 0])


def _each_term(a: Asked, F: int) -> Asked:
    """A requirement that asks for every term itself."""
    S = len(a.temperature_degc)
    response = np.eye(F)[None, :, None, :, None]
    return replace(
        a,
        share=None,
        temperature_degc=a.temperature_degc[:, :1],
        response=response,
        own=np.zeros((S, F, 1, F, 1)),
    )


def _own(flight: Flight, f: Flying, a: Asked, weights: Array, days: float) -> dict[str, float]:
    """Variances of one term that the flight draws itself."""
    spec, at = flight.spec, np.zeros((1, 1))
    along = a.temperature_degc[:, :1]
    budget = budget_of(spec.unit, f.error)
    if budget is None:
        return dict.fromkeys(("run_to_run", "in_run", "storage"), 0.0)
    still, drawn = drawn_in_flight(spec, f, along, at, days)
    walk = drawn_in_flight(spec, f, along, np.full((1, 1), np.inf), days)[0]
    return {
        "run_to_run": 0.0 if drawn is None else float(weights @ drawn[:, 0, 0]),
        "in_run": float(still[0, 0] - walk[0, 0]),
        "storage": float(walk[0, 0]),
    }


def shares(flight: Flight, found: Foreseen, requirement: int) -> dict[str, float]:
    """Error -> its part of the mean square of |d| at the last instant, SI².

    d is the sum of what each error adds, d = Σ_e d_e; an error's part is the covariance of d_e with d, so
    that what the estimates of two errors share goes to both alike.
    """
    promise, a = found.promise, found.promise.asked[requirement]
    components, _ = found.response.of(flight.spec.requirement[requirement])
    J = found.response.started(a.profile, a.instants[-1:], components)
    errors = list(dict.fromkeys(f.error for f in promise.flying))
    mine = np.array([[f.error == e for f in promise.flying] for e in errors])
    each = np.concatenate([np.where(mine[:, None, :, None], J, 0.0), J], axis=1)
    response, seen = collapsed(each, a.profile)
    S, n, c = len(seen), each.shape[1], J.shape[2]
    asked = replace(a, share=None, temperature_degc=seen, response=response, own=np.zeros((S, n, c, n, c)))
    only = replace(promise.under(found.binding(requirement)), asked=(asked,))
    [left], _ = only.covariances(found.counts)
    left = left[0, 0].reshape(S, n, c, n, c)
    own = drawn_by_flights(flight.spec, found.response, each[:, :-1], a.profile, found.days)
    weights = _weights(a)
    squares = np.zeros(len(errors))
    for e in range(len(errors)):
        both = left[:, e, :, -1, :] + own[:, e, :, e, :]
        squares[e] = float(weights @ np.trace(both, axis1=1, axis2=2))
    budgeted = [str(e) for e in errors if e not in promise.unbudgeted]
    every = {str(error): float(square) for error, square in zip(errors, squares, strict=True)}
    return {error: every[error] for error in budgeted}
