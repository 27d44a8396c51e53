"""A spec and its flight → the campaign by information.

It is searched by quick figures and foreseen by exact ones; what the quick ones miss tightens the search.
Then it is asked how much shorter another one could be.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import monotonic
from typing import Literal

import numpy as np

from planner.information.bound import Effort, Prover
from planner.information.exact import Foreseen, foreseen, laid_out
from planner.information.exchange import Judge, even, shortest
from planner.information.model_of import Flight, on_offer
from planner.information.offers import Offers
from planner.information.promise import Promise
from planner.information.redundancy import survives_any_loss
from planner.information.refusal import refusal
from planner.information.spreads import spread_factor
from planner.nouns.array import Array
from planner.nouns.choices import TestVisits
from planner.nouns.plan import Step
from planner.plan.by_hand import is_hand_made

LOOKED_AT = 3000  # campaigns of one search; ten times as many found nothing shorter on the shipped specs
BRIEFLY = 300
ROUNDS = 4
KEPT = 1.0 + 1e-6  # of a limit
QUICK_SETS, QUICK_CAMPAIGNS = 3000, 1000  # of a proof that nobody waits for
LONG_SETS, LONG_CAMPAIGNS = 2_000_000, 2_000_000


@dataclass(frozen=True)
class Found:
    """The campaign, its steps, what it promises exactly, and how much shorter another one could be.

    judge: by quick figures that meet the exact ones of this campaign, at the asked confidence
    spread_factor: what figures are multiplied by to hold with that confidence over spreads that are estimates
    """

    offers: Offers
    judge: Judge
    counts: Array
    visits: tuple[TestVisits, ...]
    timeline: tuple[Step, ...]
    foreseen: Foreseen
    spread_factor: float
    bound: float
    proved: bool

    @property
    def cost(self) -> float:
        """Weighted seconds of one batch's work."""
        return float(self.offers.cost(self.counts[None])[0])


def campaign_found(flight: Flight, *, effort: Literal["brief", "usual", "thorough"] = "usual") -> Found:
    """The shortest campaign found that keeps every requirement exactly, with a bound for all others.

    effort: brief looks at few campaigns and bounds nothing, thorough may prove for `plan.time_limit`.
    What hands made altogether is only foreseen.
    Raises InfeasibleError (what binds, nearest limit) when nothing on offer keeps the promise.
    """
    started = monotonic()
    offers, promise = on_offer(flight)
    judge = Judge(promise, np.ones(len(promise.asked)), _allowed(flight, promise))
    if is_hand_made(flight.spec):
        counts = even(offers, 1)
        cost = float(offers.cost(counts[None])[0])
        return found_of(flight, offers, judge, counts, cost, proved=True)
    counts, judge = _searched(flight, offers, judge, BRIEFLY if effort == "brief" else LOOKED_AT)
    if effort == "brief":
        return found_of(flight, offers, judge, counts)
    until = started + flight.spec.plan.time_limit
    far = (LONG_SETS, LONG_CAMPAIGNS) if effort == "thorough" else (QUICK_SETS, QUICK_CAMPAIGNS)
    factor = spread_factor(flight, offers.visits(counts))  # hardly another for a campaign that is as long
    prover = Prover(flight, offers, judge, lambda n: _keeps(flight, offers, n, factor))
    bounded = prover.bounded(counts, Effort(*far, until))
    return found_of(flight, offers, judge, bounded.best, bounded.bound, proved=bounded.proved)


def _searched(flight: Flight, offers: Offers, judge: Judge, most: int) -> tuple[Array, Judge]:
    """The shortest campaign that keeps every requirement exactly, and the judge tightened so far."""
    limits = np.array([a.limit for a in judge.promise.asked])
    for _ in range(ROUNDS):
        counts = shortest(offers, judge, most)
        if counts is None:
            raise refusal(flight, offers, judge)
        visits = offers.visits(counts)
        exact = _exactly(flight, visits) * spread_factor(flight, visits)
        if np.all(exact <= limits * KEPT):
            return counts, judge
        quick = judge.promise.figures(counts[None])[0].max(axis=0)
        judge = Judge(
            judge.promise,
            np.maximum(judge.tightened, exact / quick * (1.0 + 1e-5)),
            judge.allowed,
            judge.families,
        )
    raise refusal(flight, offers, judge)


def _keeps(flight: Flight, offers: Offers, counts: Array, factor: float) -> bool:
    limits = np.array([wanted.limit.si for wanted in flight.spec.requirement])
    return bool(np.all(_exactly(flight, offers.visits(counts)) * factor <= limits * KEPT))


def _exactly(flight: Flight, visits: Sequence[TestVisits]) -> Array:
    """(requirements,) what visits promise exactly at the stated spreads."""
    return np.array(foreseen(flight, laid_out(flight, visits)).largest)


def _allowed(flight: Flight, promise: Promise) -> Callable[[Array], bool]:
    """Further conditions on a campaign: that it can lose any one record, unless the spec lowers that."""
    if flight.spec.plan.redundancy == 0:
        return lambda n: True
    return lambda n: survives_any_loss(promise, n)


def found_of(
    flight: Flight,
    offers: Offers,
    judge: Judge,
    counts: Array,
    bound: float = 0.0,
    *,
    proved: bool = False,
) -> Found:
    """A campaign with its steps and its exact promise; bound: what none can be shorter than."""
    visits = offers.visits(counts)
    laid = laid_out(flight, visits)
    exact = foreseen(flight, laid)
    quick = judge.promise.figures(counts[None])[0].max(axis=0)
    factor = spread_factor(flight, visits)
    meets = Judge(judge.promise, np.array(exact.largest) / quick * factor, judge.allowed, judge.families)
    return Found(offers, meets, counts, visits, laid, exact, factor, bound, proved)
