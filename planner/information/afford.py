"""The inverse: what so many hours can keep: the least limits, and the grade of sensor that the limits need.

The search of the shortest campaign, under limits that are tightened until it takes longer than the hours:
what is planned for the limits named here fits them again. Between two of its answers the hours that are left
go where they ease the promise most. All limits scale alike; of a sensor, every spread of an error
(run-to-run, in-run, storage, temperature residual) is multiplied by one factor, alone or all errors together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.errors import InfeasibleError
from planner.information.choose import Found, campaign_found, condition_of, found_of
from planner.information.distinct import distinct
from planner.information.easiest import MOST_STEPS
from planner.information.even import MOST_TEMPERATURES, even
from planner.information.exchange import CHUNK, Judge, shortest
from planner.information.model_of import Flight, on_offer
from planner.information.nearest_limits import kept_limits
from planner.information.neighbours import Neighbours
from planner.information.offers import Offers
from planner.information.prices import loads_with
from planner.information.scaled import PARTS, scaled, with_limits
from planner.nouns.array import Array
from planner.nouns.deadline import SEARCH
from planner.nouns.sensor import ErrorName
from planner.plan.campaign_by_total import SAME_S, total
from planner.spec.model import Spec

BETTER = 1e-4  # of a load: a smaller gain is none
BEGINNINGS = 4
ANY = 1e9  # times a limit: whatever is determined keeps it
FARTHER = 0.9  # of a load that was reached by quick figures: the next one that is looked for
CLOSER = 0.96, 0.99  # the same by exact figures, and where there is none
LOOKED_AT = 150  # campaigns of every search
CUT = "the search"
TRIED = 3  # campaigns of the least loads by quick figures whose exact ones are asked
SMALLEST, LARGEST = 1.0 / 64.0, 64.0  # factors of a sensor's spreads that are looked at
HALVINGS = 12
ROUNDS = 6  # of hours of one batch's work, until those of the whole plan are kept


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
    cut: what `plan.time_limit` cut short
    """

    found: Found
    load: float
    limits: tuple[float, ...]
    grades: tuple[Grade, ...]
    cut: tuple[str, ...] = ()


def affordable(flight: Flight, seconds: float) -> Affordable:
    """What a campaign of at most so many seconds can keep, whatever its power-on hours.

    The seconds are those of the whole plan, with its loads and waiting; the search counts one batch's work.
    Raises InfeasibleError when no campaign within them determines everything that flies; it names the
    shortest that was found.
    """
    flight = flight.under(_by_time(flight.spec))
    offers, promise = on_offer(flight)
    judge = Judge(promise, allowed=condition_of(flight, promise), late=flight.deadline.stops(SEARCH, CUT))
    begun = _begun(flight, offers, judge, seconds)
    least = float(offers.cost(begun[None])[0])
    work = max(least, seconds * least / total(flight.spec, offers.visits(begun)))
    for _ in range(ROUNDS):
        quick = _by_quick_figures(offers, judge, begun, work)[:TRIED]
        each = [found_of(flight, offers, judge, n) for n in quick]
        found = _by_exact_figures(flight, min(each, key=lambda f: _load(flight, f)), work)
        took = total(flight.spec, found.visits)
        if took <= seconds + SAME_S or work <= least:
            break
        work = max(least, work * seconds / took)
    if took > seconds + SAME_S:
        found = found_of(flight, offers, judge, begun)
    load, promise = _load(flight, found), found.judge.promise
    errors = [e for e in dict.fromkeys(f.error for f in promise.flying) if e not in promise.unbudgeted]
    grades = [_grade(flight, found, load, "", errors)]
    grades += [_grade(flight, found, load, str(e), [e]) for e in errors]
    # drawn as closely as a plan with these limits draws them
    least_load = float((kept_limits(flight, found.offers, found.counts) / flight.limits).max())
    limits = tuple(float(x) for x in least_load * flight.limits)
    return Affordable(found, load, limits, tuple(grades), tuple(flight.deadline.cut))


def _by_time(spec: Spec) -> Spec:
    """The spec of which campaigns cost their time alone: hours are no weighted sum."""
    return spec.model_copy(update={"plan": spec.plan.model_copy(update={"minimise": "time"})})


def _load(flight: Flight, found: Found) -> float:
    """The largest share of a limit by exact figures, times their factors for spreads that are estimates."""
    return float((np.array(found.foreseen.largest) * found.spread_factors / flight.limits).max())


def _by_exact_figures(flight: Flight, best: Found, seconds: float) -> Found:
    """The least load for which the seconds suffice to the plan's own search, under limits so wide."""
    load, late = _load(flight, best), flight.deadline.stops(SEARCH, CUT)
    for step in CLOSER:
        while not late():
            try:
                found = campaign_found(flight.under(with_limits(flight.spec, step * load)), effort="brief")
            except InfeasibleError:
                break
            other = _load(flight, found)
            if found.cost > seconds or not other < load * (1.0 - BETTER):
                break
            best, load = found, other
    return best


def _begun(flight: Flight, offers: Offers, judge: Judge, seconds: float) -> Array:
    """(g,) the shortest campaign found that determines everything; InfeasibleError: it takes longer."""
    begun = shortest(offers, judge.loosened(ANY), LOOKED_AT)
    took = np.inf if begun is None else total(flight.spec, offers.visits(begun))
    if begun is None or took > seconds + SAME_S:
        least = "" if begun is None else f"; the shortest found that does takes {took / 3600:.2f} h"
        raise InfeasibleError(
            f"no campaign of {seconds / 3600:g} h determines every error that flies{least}; give more hours"
        )
    return begun


def _by_quick_figures(offers: Offers, judge: Judge, begun: Array, seconds: float) -> list[Array]:
    """(g,) campaigns of small loads within the seconds of one batch's work, the smallest first."""
    starts = [even(offers, N, main) for N in range(1, MOST_TEMPERATURES + 1) for main in _mains(offers, N)]
    every = distinct([begun, *starts])
    within = every[offers.cost(every) <= seconds]
    loads = _loads(judge, within)
    found = [_eased(offers, judge, within[i], seconds) for i in np.argsort(loads)[:BEGINNINGS]]
    found += _tightened(offers, judge, float(_loads(judge, np.array(found)).min()), seconds)
    found = [n for n in distinct(found) if judge.allowed(n)] or [begun]
    return [found[i] for i in np.argsort(_loads(judge, np.array(found)))]


def _tightened(offers: Offers, judge: Judge, load: float, seconds: float) -> list[Array]:
    """Campaigns within the seconds, each of less load than the one before and than `load`."""
    found: list[Array] = []
    while not judge.late():
        n = shortest(offers, judge.loosened(FARTHER * load), LOOKED_AT)
        if n is None or offers.cost(n[None])[0] > seconds:
            break
        found.append(_eased(offers, judge, n, seconds))
        reached = float(_loads(judge, found[-1][None])[0])
        if not reached < load * (1.0 - BETTER):
            break
        load = reached
    return found


def _loads(judge: Judge, counts: Array) -> Array:
    """(B,) under every family."""
    every = list(judge.promise.families)
    return np.concatenate([judge.loads(counts[i : i + CHUNK], every) for i in range(0, len(counts), CHUNK)])


def _mains(offers: Offers, N: int) -> list[str | None]:
    chosen = [o.test for o in offers.tests if not o.everywhere and o.fixed is None]
    return [None, *(chosen if len(chosen) > 1 and N > 1 else ())]


def _eased(offers: Offers, judge: Judge, n: Array, seconds: float) -> Array:
    """Steps within the seconds, each to the neighbour of the least load, as long as it falls."""
    moves, load = Neighbours(offers), float(_loads(judge, n[None])[0])
    for _ in range(MOST_STEPS):
        near = np.concatenate([moves.of(n), moves.more(n)])
        near = near[offers.cost(near) <= seconds]
        if not len(near) or judge.late():
            break
        loads = _loads(judge, near)
        better = [i for i in np.argsort(loads) if loads[i] < load * (1.0 - BETTER)]
        best = next((i for i in better if judge.allowed(near[i])), None)
        if best is None:
            break
        n, load = near[best], float(loads[best])
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
