"""Which limits could be kept where those that are asked for cannot: named so that a plan with them is found.

What `planner.information.easiest` finds by quick figures is eased by exact ones, and limits are what these
figures reach. A plan with such limits asks the same campaigns, so that it is not refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.information.easiest import easiest
from planner.information.exact import CLOSE, CLOSELY, foreseen, laid_out, unseen_figures
from planner.information.exchange import Judge
from planner.information.model_of import Flight
from planner.information.neighbours import Neighbours
from planner.information.offers import Offers
from planner.information.spreads import spread_factors
from planner.nouns.array import Array
from planner.units import Quantity

ROUNDS = 6
ALIKE, ABOUT = 16, 1.25  # that are asked exactly, of those that load the promise by so much more at most
WORTH, BESIDE = 6_000, 300  # power-ons of all that are asked; of each, what takes as long beside its own
SETTLED = 1e-4  # share of the load that makes a step worth its seconds
ABOVE = 1.0 + 1e-4  # figures reached: a limit is kept to the last digit that it is written with
WIDENED = 6  # times that limits are widened until they can be kept together


def alone(judge: Judge, k: int) -> Judge:
    """The judge of requirement k alone, of the others nothing is asked."""
    promise = replace(judge.promise, asked=(judge.promise.asked[k],))
    return replace(judge, promise=promise, tightened=judge.tightened[:, [k]], families=list(judge.families))


def eased(
    flight: Flight, offers: Offers, judge: Judge, n: Array, requirements: Sequence[int] | None = None
) -> Array:
    """A campaign about as easy as n (g,) by quick figures, and easier by exact ones; n where none is.

    Of campaigns of thousands of power-ons few are asked: one figure of theirs takes seconds.
    requirements: those that the judge asks, None: all
    """
    asked = [*range(len(flight.limits))] if requirements is None else [*requirements]

    def load(n: Array) -> float:
        visits = offers.visits(n)
        loads = unseen_figures(flight, visits) * spread_factors(flight, visits) / flight.limits
        return float(loads[:, asked].max())

    def unless_late(n: Array) -> float:
        return load(n) if judge.allowed(n) and not judge.late() else np.inf

    moves, every = Neighbours(offers), [*judge.promise.families]
    own = load(n) if judge.allowed(n) else np.inf
    left = float(WORTH)
    for _ in range(ROUNDS):
        near = moves.whatever_they_cost(n)
        if not len(near) or own <= 1.0 or judge.late():
            break
        quick = judge.loads(near, every)
        alike = np.argsort(quick, kind="stable")[:ALIKE]
        alike = alike[quick[alike] <= ABOUT * judge.loads(n[None], every)[0]]
        work = np.cumsum(BESIDE + near[alike].sum(axis=1))
        alike = alike[work <= left]
        left -= work[len(alike) - 1] if len(alike) else 0.0
        exact = [unless_late(near[i]) for i in alike]
        if not exact or not min(exact) < own * (1.0 - SETTLED):
            break
        n, own = near[alike[int(np.argmin(exact))]], min(exact)
    return n


def kept_limits(flight: Flight, offers: Offers, n: Array) -> Array:
    """(requirements,) SI: the least limits that a plan would say a campaign (g,) keeps; infinite: untold.

    Near to a limit more flights are drawn than far from it: what is found there counts for the limit itself.
    """
    visits = offers.visits(n)
    factors, usual = spread_factors(flight, visits), unseen_figures(flight, visits)
    if not np.all(np.isfinite(usual)):
        return np.full(len(factors), np.inf)
    steps = laid_out(flight, visits, first_only=True)
    closely = foreseen(flight.unseen, steps, draws=CLOSELY).figures
    found = np.empty(len(factors))
    for k, factor in enumerate(factors):
        u, c = usual[:, k], closely[:, k]
        tried = sorted(
            float(x) * ABOVE for x in {c.max() * factor, u.max() * factor, u.max() / (1.0 - CLOSE)}
        )
        judged = (np.where(np.abs(u / limit - 1.0) < CLOSE, c, u).max() * factor for limit in tried)
        found[k] = next((x for x, y in zip(tried, judged, strict=True) if y <= x), tried[-1])
    return found


def met_together(
    flight: Flight,
    offers: Offers,
    judge: Judge,
    limits: Array,
    named: Sequence[int],
    near: Sequence[Array] = (),
) -> Array:
    """(requirements,) limits, SI, of which those that are named are widened until one campaign keeps all.

    What is never kept beside the others that way is widened as well. near: campaigns (g,) from which to begin
    """
    limits, reached, known = limits.copy(), limits, [*near]
    quick = judge.meeting(np.ones_like(judge.tightened))
    for _ in range(WIDENED):
        other, asking = _limited(flight, quick, limits)
        n = easiest(offers, asking.by_family, [*asking.promise.families], judge.late, known=known)
        known.append(n)
        closer = unseen_figures(other, offers.visits(n)) / asking.promise.figures(n[None])[0]
        reached = kept_limits(other, offers, eased(other, offers, asking.meeting(closer), n))
        load = float((reached / limits).max())
        if load <= ABOVE or judge.late() or not np.isfinite(load):
            break
        limits[[*named]] *= load
    return np.where(np.isfinite(reached), np.maximum(limits, reached), limits)


def _limited(flight: Flight, judge: Judge, limits: Array) -> tuple[Flight, Judge]:
    """The same flight and judge with other limits (requirements,), SI."""
    wanted = tuple(
        requirement.model_copy(update={"limit": _of_size(requirement.limit, float(limit))})
        for requirement, limit in zip(flight.spec.requirement, limits, strict=True)
    )
    asked = tuple(
        replace(a, limit=float(limit)) for a, limit in zip(judge.promise.asked, limits, strict=True)
    )
    other = flight.under(flight.spec.model_copy(update={"requirement": wanted}))
    return other, replace(judge, promise=replace(judge.promise, asked=asked), families=list(judge.families))


def _of_size(limit: Quantity, si: float) -> Quantity:
    return replace(limit, si=si)
