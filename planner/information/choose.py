"""A spec and its flight → the campaign by information: searched quickly, foreseen exactly, searched again if need be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.errors import InfeasibleError
from planner.information.exact import Foreseen, foreseen
from planner.information.exchange import Judge, shortest
from planner.information.model_of import Flight, on_offer
from planner.information.offers import Offers
from planner.nouns.array import Array
from planner.nouns.choices import Campaign, TestVisits
from planner.nouns.plan import Step
from planner.plan.schedule_to_steps import steps

LOOKED_AT = 3000  # campaigns of one search; ten times as many found nothing shorter on the shipped specs
ROUNDS = 4
AT_ONCE = 1e-6


@dataclass(frozen=True)
class Found:
    """The campaign, its steps, and what it promises exactly."""

    offers: Offers
    judge: Judge
    counts: Array
    visits: tuple[TestVisits, ...]
    timeline: tuple[Step, ...]
    foreseen: Foreseen

    @property
    def cost(self) -> float:
        """Weighted seconds of one batch's work."""
        return float(self.offers.cost(self.counts[None])[0])


def campaign_found(flight: Flight) -> Found:
    """The shortest campaign found that keeps every requirement exactly.

    The quick figures of the search leave out the days of the campaign and most instants; what they miss of the
    exact ones tightens the search. Raises InfeasibleError when nothing on offer keeps the promise.
    """
    offers, promise = on_offer(flight)
    judge = Judge(promise, np.ones(len(promise.asked)))
    limits = np.array([a.limit for a in promise.asked])
    best: Found | None = None
    for _ in range(ROUNDS):
        counts = shortest(offers, judge, LOOKED_AT)
        if counts is None:
            break
        found = timed(flight, offers, judge, counts)
        exact = np.array(found.foreseen.largest)
        if np.all(exact <= limits * (1.0 + AT_ONCE)):
            if best is None or found.cost < best.cost:
                best = found
            break
        quick = promise.figures(counts[None])[0].max(axis=0)
        judge = Judge(promise, np.maximum(judge.tightened, exact / quick * (1.0 + 1e-5)), judge.allowed)
    if best is None:
        raise InfeasibleError("no campaign of the tests on offer keeps the requirements")
    return best


def timed(flight: Flight, offers: Offers, judge: Judge, counts: Array) -> Found:
    """A campaign with its steps and its exact promise."""
    visits = offers.visits(counts)
    laid = laid_out(flight, visits)
    return Found(offers, judge, counts, visits, laid, foreseen(flight, laid))


def laid_out(flight: Flight, visits: Sequence[TestVisits]) -> tuple[Step, ...]:
    """The steps of visits on the benches."""
    return steps(flight.spec, Campaign(tuple(visits), (), 0.0, 0.0, False))
