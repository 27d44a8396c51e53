"""Why no campaign on offer keeps the promise: what the most records leave, what binds, the nearest limit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.errors import InfeasibleError, InputError
from planner.information.easiest import easiest
from planner.information.even import MOST_TEMPERATURES, even, most_repeats
from planner.information.exact import quickly, unseen_figures
from planner.information.exchange import Judge
from planner.information.model_of import Flight
from planner.information.nearest_limits import ABOVE, alone, eased, kept_limits, met_together
from planner.information.offers import Offers
from planner.information.parts import left_in_flight, shares
from planner.information.spreads import spread_factors
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.plan.repeats_to_schedule import figure, rounded_up
from planner.spec.model import NAVIGATION_ERRORS
from planner.units import from_si

SHOWN = 4


def nearest(flight: Flight, offers: Offers, judge: Judge) -> list[Array]:
    """The campaigns that come nearest to the promise by quick figures, whatever they cost.

    First of all requirements together, then of each alone; of one requirement that is the same, and so it is
    of those that the first one keeps exactly: none of them is what cannot be met.
    """
    every = list(judge.promise.families)
    if len(judge.promise.asked) == 1:
        return [easiest(offers, judge.by_family, every, judge.late)]
    hardest = _hardest(offers, judge)
    first = _easiest(offers, judge, hardest)  # whatever the other limits are: what is named is found again
    together = easiest(offers, judge.by_family, every, judge.late, known=[first])
    kept = _kept(flight, offers, judge, together)
    alone = (
        together if kept[k] else first if k == hardest else _easiest(offers, judge, k)
        for k in range(len(kept))
    )
    return [together, *alone]


def _hardest(offers: Offers, judge: Judge) -> int:
    """The requirement that the campaigns at even temperatures with the most repeats are farthest from."""
    every = np.array([most_repeats(offers, even(offers, N)) for N in range(1, MOST_TEMPERATURES + 1)])
    loads = judge.figures(every) / [a.limit for a in judge.promise.asked]
    return int(np.argmax(loads.min(axis=0)))


def _kept(flight: Flight, offers: Offers, judge: Judge, n: Array) -> NDArray[np.bool_]:
    """(requirements,) whether a campaign (g,) keeps each by exact figures."""
    if not np.all(np.isfinite(judge.promise.figures(n[None]))):
        return np.zeros(len(flight.limits), dtype=bool)
    visits = offers.visits(n)
    figures = unseen_figures(flight, visits) * spread_factors(flight, visits)
    return np.asarray((figures <= flight.limits).all(axis=0))


def refusal(
    flight: Flight, offers: Offers, judge: Judge, near: Sequence[Array]
) -> InfeasibleError | InputError:
    """The error to raise: every requirement that its own campaign of the `nearest` does not meet."""
    each = near[1:] or near
    figures = judge.promise.figures(np.array(each)).max(axis=1)
    if not np.any(np.isfinite(figures)):
        return untold(judge, each, "no campaign of the tests on offer tells")
    distinct = {n.tobytes(): n for n in near}
    limits = {key: kept_limits(flight, offers, n) for key, n in distinct.items()}
    reached = np.array([limits[n.tobytes()] for n in near])
    if np.all(reached[0] <= flight.limits):
        return InfeasibleError(
            "campaigns that keep the requirement rest on single records, or tell errors only together; allow "
            "more repeats, or 'plan.redundancy: 0'"
        )
    if len(near) == 1:
        return _error(flight, judge, {0: (near[0], float(reached[0, 0]))}, reached[0])
    least = {
        k: _least(flight, offers, judge, n, k)
        for k, n in enumerate(each)
        if reached[1 + k, k] > flight.limits[k]
    }
    least = {k: one for k, one in least.items() if one[1][k] > flight.limits[k]}
    if not least:
        return _not_together(flight, offers, judge, reached[0], near)
    beyond = {k: (n, float(kept[k])) for k, (n, kept) in least.items()}
    wanted = flight.limits.copy()
    wanted[[*beyond]] = [value for _, value in beyond.values()]
    known = [*reached, *(kept for _, kept in least.values())]
    if not any(np.all(kept <= wanted * ABOVE) for kept in known):
        wanted = met_together(flight, offers, judge, wanted, [*beyond], near)
    return _error(flight, judge, beyond, wanted)


def _least(flight: Flight, offers: Offers, judge: Judge, n: Array, k: int) -> tuple[Array, Array]:
    """The campaign by which requirement k alone is reached best, eased from n (g,), and its limits, SI."""
    found = eased(flight, offers, alone(judge, k), n, [k])
    return found, kept_limits(flight, offers, found)


def _not_together(
    flight: Flight, offers: Offers, judge: Judge, reached: Array, near: Sequence[Array]
) -> InfeasibleError:
    """Each can be met, not all; reached: (requirements,) by the campaign that comes nearest to all, SI."""
    named = np.flatnonzero(reached > flight.limits).tolist()
    limits = met_together(flight, offers, judge, np.maximum(flight.limits, reached), named, near)
    wider = np.flatnonzero(limits > flight.limits).tolist()
    said = " and ".join(_words(flight, k, float(limits[k])) for k in wider)
    cut = "".join(f"; {words}" for words in _cut_short(flight))
    return InfeasibleError(
        f"the requirements can be met one by one but not together; together they can with {said}{cut}",
        requirement=wider[0],
        nearest_limit=float(limits[wider[0]]),
    )


def _cut_short(flight: Flight) -> list[str]:
    """What makes of a refusal no last word: that time was over before all was looked at."""
    if not flight.deadline.cut:
        return []
    seconds = flight.deadline.seconds
    return [f"plan.time_limit ({seconds:g} s) cut the search short: with more time less may be reached"]


def _words(flight: Flight, k: int, value: float) -> str:
    """A requirement with another limit."""
    wanted = flight.spec.requirement[k]
    unit = NAVIGATION_ERRORS[wanted.error]
    return f"requirement {k + 1} ({wanted.error}) within {rounded_up(from_si(value, unit))} {unit}"


def untold(judge: Judge, near: Sequence[Array], opening: str) -> InputError:
    """What flies and no record tells, of the campaign that leaves the least of it open, and what helps."""
    names = min((judge.promise.untold(n) for n in near), key=len)
    effects = dict.fromkeys(name.effect for name in names)
    of_days = all("day" in catalog.effects()[effect].needs for effect in effects)
    why = (
        "no plan spreads records over the days that it needs"
        if of_days
        else "add motions, loads or temperatures that show it"
    )
    whose = ", ".join(f"{name} ({_some(terms)})" for name, terms in names.items())
    return InputError(
        f"{opening} {whose}; {why}; "
        f"take {', '.join(effects)} out of 'effects': its budget then stays whole in what is promised"
    )


def _some(terms: Sequence[str]) -> str:
    more = len(terms) - SHOWN
    return ", ".join(terms[:SHOWN]) + (f" and {more} more" if more > 0 else "")


def _easiest(offers: Offers, judge: Judge, k: int) -> Array:
    """The campaign that keeps requirement k most easily; the others are not asked."""
    alone = replace(judge.promise, asked=(judge.promise.asked[k],))
    families = [*alone.families]
    return easiest(offers, lambda n, names: alone.figures(n, names)[:, :, 0], families, judge.late)


def _error(
    flight: Flight, judge: Judge, beyond: Mapping[int, tuple[Array, float]], together: Array
) -> InfeasibleError:
    """Of requirements that cannot be met: their campaigns (g,), the least that each reaches alone, SI, and

    together: (requirements,) limits, SI, that one campaign keeps.
    """
    binds = {k: _binding(flight, judge, n, k) for k, (n, _) in beyond.items()}
    said = [_cannot(flight, k, value, binds[k], together) for k, (_, value) in beyond.items()]
    others = [k for k in np.flatnonzero(together > flight.limits).tolist() if k not in beyond]
    if others:
        said.append("beside them " + " and ".join(_words(flight, k, float(together[k])) for k in others))
    said += _cut_short(flight)
    first = next(iter(beyond))
    return InfeasibleError(
        "; ".join(said), requirement=first, binds=binds[first], nearest_limit=float(together[first])
    )


def _cannot(flight: Flight, k: int, value: float, binds: Sequence[tuple[str, float]], together: Array) -> str:
    wanted = flight.spec.requirement[k]
    unit = NAVIGATION_ERRORS[wanted.error]
    shown = ", ".join(f"{name} {share:.0%}" for name, share in binds[:SHOWN] if share >= 0.005)
    beside = " beside the others" if together[k] > value * ABOVE else ""
    return (
        f"requirement {k + 1} ({wanted.error} within {figure(from_si(wanted.limit.si, unit))} {unit}) "
        f"cannot be met: with the most records at the best temperatures, "
        f"{figure(from_si(value, unit))} {unit} are reached; what binds: {shown}; "
        f"the nearest limit that can be met{beside} is {rounded_up(from_si(float(together[k]), unit))} {unit}"
    )


def _binding(flight: Flight, judge: Judge, n: Array, k: int) -> tuple[tuple[str, float], ...]:
    """Share of every part of every error in the requirement's square, the largest first."""
    found = quickly(flight, judge.promise, n[None])
    parts, of_error = left_in_flight(flight, found, k).parts, shares(flight, found, k)
    total = sum(of_error.values()) or 1.0
    binds = []
    for error, square in of_error.items():
        own = {name: value**2 for name, value in parts[ErrorName(error)].items()}
        whole = sum(own.values()) or 1.0
        binds += [(f"{error} {name}", square / total * value / whole) for name, value in own.items()]
    return tuple(sorted(binds, key=lambda item: -item[1]))
