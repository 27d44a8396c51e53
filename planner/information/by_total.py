"""Several units, batches and shifts: the campaign by information of the least total time.

The search chooses by one unit's work. The total, with waiting and loads of unequal benches, is no sum over
resources; so campaigns are sought downhill for other prices, as of the published method (campaign_by_total):
benches dearer by their loads, people's hours dearer by what a shift leaves of a week. They are timed, and the
one that is done first is kept. For shares of the bottleneck among the benches the prices bound the total.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from planner.information.bound import Effort, Prover
from planner.information.choose import QUICK, Found, found_of, keeps_exactly
from planner.information.exchange import Judge, enough, shorter
from planner.information.model_of import Flight
from planner.information.offers import Offers, offers_of
from planner.nouns.array import Array
from planner.nouns.deadline import BOUND
from planner.plan.campaign_by_total import SAME_S, prices_by_total, total
from planner.plan.costs import Tariff
from planner.spec.model import Spec

LOOKED_AT = 150  # campaigns for every other prices
STAGE = "the campaign of least total time"


def by_total(flight: Flight, found: Found) -> Found:
    """The campaign of least total time that was met, with a bound of the total for every campaign."""
    spec, late = flight.spec, flight.deadline.stops(BOUND, STAGE)
    least, best, bounds = total(spec, found.visits), found, [found.bound]
    judge = replace(found.judge, late=late, families=list(found.judge.families))
    prover = Prover(flight, found.offers, judge, lambda n: False)
    for offers, start, is_bound in _beginnings(spec, found, judge):
        if late():
            break
        counts = shorter(offers, replace(judge, asked=0), start, LOOKED_AT)
        if is_bound:
            prover = prover.priced(offers)
            bounds.append(_bound(prover, counts, late))
        seconds = total(spec, found.offers.visits(counts))
        if seconds < least - SAME_S and keeps_exactly(flight, found.offers, found.judge, counts):
            best, least = found_of(flight, found.offers, judge, counts, found.bound), seconds
    return replace(best, total_bound=min(max(bounds), least), by_total=best is not found)


def _beginnings(spec: Spec, found: Found, judge: Judge) -> Iterator[tuple[Offers, Array, bool]]:
    """(prices, where to go downhill from, whether these prices bound the total)."""
    elsewhere = [
        n for start in _on_other_benches(found) if (n := enough(found.offers, judge, start)) is not None
    ]
    yield from ((found.offers, n, False) for n in elsewhere)
    tariff = Tariff(spec, [k.temperature_degc for k in found.offers.kinds])
    for prices in prices_by_total(spec, tariff.resources):
        offers = offers_of(spec, found.offers.kinds, prices.prices)
        near = np.array([found.counts, *elsewhere])
        yield offers, near[np.argmin(offers.cost(near))], prices.is_bound


def _on_other_benches(found: Found) -> Iterator[Array]:
    """The campaign with what is done on one bench done on another by tests for the same errors."""
    offers, tests = found.offers, found.offers.spec.tests
    used = dict.fromkeys(tests[visit.test].bench for visit in found.visits)
    for bench in used:
        for other in [name for name in offers.spec.benches if name != bench]:
            n = found.counts.copy()
            for offer in [o for o in offers.tests if tests[o.test].bench == bench and n[o.places].any()]:
                for k in offer.places[n[offer.places] > 0]:
                    to = _twin(offers, int(k), other)
                    if to is not None:
                        n[to], n[k] = max(n[k], n[to]), 0.0
            if not np.array_equal(n, found.counts):
                yield n


def _twin(offers: Offers, k: int, bench: str) -> int | None:
    """The kind of another bench for the same errors, at the temperature nearest to that of k."""
    tests, degc = offers.spec.tests, offers.degc
    served = set(tests[offers.kinds[k].test].calibrates)
    for offer in offers.tests:
        test = tests[offer.test]
        if test.bench == bench and served <= set(test.calibrates) and offer.fixed is None:
            return int(offer.places[np.argmin(np.abs(degc[offer.places] - degc[k]))])
    return None


def _bound(prover: Prover, counts: Array, late: Callable[[], bool]) -> float:
    """What no campaign's total is less than, by prices of the bottleneck; no campaign is asked here."""
    cost = float(prover.offers.cost(counts[None])[0])
    survivors, beyond = prover.survivors(cost, Effort(*QUICK, late))
    return min([*(floor for floor, _ in survivors), beyond, cost])
