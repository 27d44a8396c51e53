"""The inverse: what so many hours can keep: the least limits, and the grade of sensor that the limits need.

The campaign within the hours that keeps the least share of the limits is searched by exchange, as the
shortest one is, with cost and load in each other's place. All limits scale alike; of a sensor, every spread
of an error (run-to-run, in-run, storage, temperature residual) is multiplied by one factor, alone or all
errors together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.errors import InfeasibleError
from planner.information.choose import Found, found_of
from planner.information.easiest import MOST_STEPS
from planner.information.even import MOST_TEMPERATURES, even
from planner.information.exchange import CHUNK, Judge
from planner.information.model_of import Flight, on_offer
from planner.information.neighbours import Neighbours
from planner.information.offers import Offers
from planner.information.prices import loads_with
from planner.information.scaled import PARTS, scaled
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.spec.model import Spec

BETTER = 1e-4  # of a load: a smaller gain is none
BEGINNINGS = 4
SMALLEST, LARGEST = 1.0 / 64.0, 64.0  # factors of a sensor's spreads that are looked at
HALVINGS = 12


@dataclass(frozen=True)
class Grade:
    """By what factor the spreads of an error may be as large; None: no factor that is looked at suffices.

    error: empty for all errors together; at_least: whether even the largest factor that is looked at is kept
    """

    error: str
    factor: float | None
    at_least: bool = False


@dataclass(frozen=True)
class Affordable:
    """What the hours keep. found: the campaign; load: share of the limits that it uses, exactly

    limits: (requirements,) the least that it keeps, SI, all scaled alike; grades: of the sensor
    """

    found: Found
    load: float
    limits: tuple[float, ...]
    grades: tuple[Grade, ...]


def affordable(flight: Flight, seconds: float) -> Affordable:
    """What a campaign of at most so many weighted seconds can keep.

    Raises InfeasibleError when no campaign within them determines everything that flies; it names the
    shortest.
    """
    offers, promise = on_offer(flight)
    judge = Judge(promise, families=list(promise.families))
    counts = _most_accurate(offers, judge, seconds)
    found = found_of(flight, offers, judge, counts)
    load = float((np.array(found.foreseen.largest) / flight.limits).max())
    errors = [e for e in dict.fromkeys(f.error for f in promise.flying) if e not in promise.unbudgeted]
    grades = [_grade(flight, found, load, "", errors)]
    grades += [_grade(flight, found, load, str(e), [e]) for e in errors]
    return Affordable(found, load, tuple(float(x) for x in load * flight.limits), tuple(grades))


def _most_accurate(offers: Offers, judge: Judge, seconds: float) -> Array:
    """(g,) the campaign of the least load within the seconds, by steps from several beginnings."""
    starts = [even(offers, N, main) for N in range(1, MOST_TEMPERATURES + 1) for main in _mains(offers, N)]
    every = np.unique(np.array(starts), axis=0)
    cost = offers.cost(every)
    within = every[cost <= seconds]
    loads = judge.loads(within) if len(within) else np.empty(0)
    if not np.any(np.isfinite(loads)):
        determined = cost[np.isfinite(judge.loads(every))]
        least = f"; one that does takes about {determined.min() / 3600:.2f} h" if len(determined) else ""
        raise InfeasibleError(
            f"no campaign of {seconds / 3600:g} h determines every error that flies{least}; give more hours"
        )
    best = [_eased(offers, judge, within[i], seconds) for i in np.argsort(loads)[:BEGINNINGS]]
    return min(best, key=lambda n: float(judge.loads(n[None])[0]))


def _mains(offers: Offers, N: int) -> list[str | None]:
    chosen = [o.test for o in offers.tests if not o.everywhere and o.fixed is None]
    return [None, *(chosen if len(chosen) > 1 and N > 1 else ())]


def _eased(offers: Offers, judge: Judge, n: Array, seconds: float) -> Array:
    """Steps within the seconds, each to the neighbour of the least load, as long as it falls."""
    moves, load = Neighbours(offers), float(judge.loads(n[None])[0])
    for _ in range(MOST_STEPS):
        near = np.concatenate([moves.of(n), moves.more(n)])
        near = near[offers.cost(near) <= seconds]
        parts = [judge.loads(near[i : i + CHUNK]) for i in range(0, len(near), CHUNK)]
        loads = np.concatenate(parts) if parts else np.empty(0)
        if not len(loads) or loads.min() >= load * (1.0 - BETTER):
            return n
        n, load = near[int(loads.argmin())], float(loads.min())
    return n


def _grade(flight: Flight, found: Found, load: float, name: str, errors: list[ErrorName]) -> Grade:
    """The factor at which the campaign just keeps the limits: bisection of its logarithm."""

    def keeps(factor: float) -> bool:
        return loads_with(flight, found, _all_scaled(flight.spec, errors, factor)) <= 1.0

    if load > 1.0 and not keeps(SMALLEST):
        return Grade(name, None)
    if keeps(LARGEST):
        return Grade(name, LARGEST, at_least=True)
    low, high = (1.0, LARGEST) if load <= 1.0 else (SMALLEST, 1.0)
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if keeps(middle) else (low, middle)
    return Grade(name, low)


def _all_scaled(spec: Spec, errors: list[ErrorName], factor: float) -> Spec:
    for error in errors:
        spec = scaled(spec, error, factor, PARTS)
    return spec
