"""Why no campaign on offer keeps the promise: what the most records leave, what binds, the nearest limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner import catalog
from planner.errors import InfeasibleError, InputError
from planner.information.easiest import easiest
from planner.information.exact import quickly, unseen_figures
from planner.information.exchange import Judge
from planner.information.model_of import Flight
from planner.information.offers import Offers
from planner.information.parts import left_in_flight, shares
from planner.information.spreads import spread_factors
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.plan.repeats_to_schedule import figure, rounded_up
from planner.spec.model import NAVIGATION_ERRORS
from planner.units import from_si

SHOWN = 4
FORESEEN = 1.001  # the search's quick figures may lie so far from the exact ones of two campaigns alike


def nearest(offers: Offers, judge: Judge) -> list[Array]:
    """The campaigns that come nearest to the promise by quick figures, whatever they cost.

    First of all requirements together, then of each alone; of one requirement that is the same.
    """
    every = list(judge.promise.families)
    together = easiest(offers, judge.by_family, every, judge.late)
    alone = range(len(judge.promise.asked)) if len(judge.promise.asked) > 1 else ()
    return [together, *(_easiest(offers, judge, k) for k in alone)]


def refusal(
    flight: Flight, offers: Offers, judge: Judge, near: Sequence[Array]
) -> InfeasibleError | InputError:
    """The error to raise: every requirement that its own campaign of the `nearest` does not meet."""
    each = near[1:] or near
    figures = judge.promise.figures(np.array(each)).max(axis=1)
    if not np.any(np.isfinite(figures)):
        return untold(judge, each, "no campaign of the tests on offer tells")
    beyond = [_beyond(flight, offers, judge, n, k) for k, n in enumerate(each)]
    found = [b for b in beyond if b is not None]
    if not found:
        return InfeasibleError("the requirements can be met one by one but not together")
    first = found[0]
    said = "; ".join(b.words for b in found)
    return InfeasibleError(said, requirement=first.requirement, binds=first.binds, nearest_limit=first.value)


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


@dataclass(frozen=True)
class _Beyond:
    """A requirement that cannot be met: the least that is reached, SI, and what makes it up."""

    requirement: int
    value: float
    binds: tuple[tuple[str, float], ...]
    words: str


def _easiest(offers: Offers, judge: Judge, k: int) -> Array:
    """The campaign that keeps requirement k most easily; the others are not asked."""
    alone = replace(judge.promise, asked=(judge.promise.asked[k],))
    families = [*alone.families]
    return easiest(offers, lambda n, names: alone.figures(n, names)[:, :, 0], families, judge.late)


def _beyond(flight: Flight, offers: Offers, judge: Judge, n: Array, k: int) -> _Beyond | None:
    wanted = flight.spec.requirement[k]
    visits = offers.visits(n)
    exact = float(unseen_figures(flight, visits)[:, k].max())
    value = max(exact * spread_factors(flight, visits)[k], float(judge.figures(n[None])[0, k])) * FORESEEN
    if value <= wanted.limit.si:
        return None
    unit, binds = NAVIGATION_ERRORS[wanted.error], _binding(flight, judge, n, k)
    shown = ", ".join(f"{name} {share:.0%}" for name, share in binds[:SHOWN] if share >= 0.005)
    return _Beyond(
        k,
        value,
        binds,
        f"requirement {k + 1} ({wanted.error} within {figure(from_si(wanted.limit.si, unit))} {unit}) "
        f"cannot be met: with the most records at the best temperatures, "
        f"{figure(from_si(value, unit))} {unit} are reached; what binds: {shown}; "
        f"the nearest limit that can be met is {rounded_up(from_si(value, unit))} {unit}",
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
