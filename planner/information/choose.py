"""A spec and its flight → the campaign by information.

It is searched by quick figures and foreseen by exact ones; what the quick ones miss tightens the search.
Then it is asked how much shorter another one could be.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from planner.information.bound import Effort, Prover
from planner.information.cancelled import leaves_products_small, refuse_what_only_cancels
from planner.information.easiest import EASIER
from planner.information.even import even
from planner.information.exact import Foreseen, broken_by_far, foreseen, laid_out, unseen, unseen_figures
from planner.information.exchange import Judge, beginnings, enough, shorter, shortest
from planner.information.model_of import Flight, on_offer
from planner.information.nearest_limits import eased
from planner.information.offers import Offers
from planner.information.promise import Promise
from planner.information.redundancy import survives_any_loss
from planner.information.refusal import nearest, refusal, untold
from planner.information.spreads import spread_factors
from planner.nouns.array import Array
from planner.nouns.choices import TestVisits
from planner.nouns.deadline import BOUND, SEARCH, never
from planner.nouns.step import Step
from planner.plan.by_hand import is_hand_made

LOOKED_AT = 1000
BRIEFLY = 300
ROUNDS = 6
CLOSER = 1.0 + 1e-5  # than the exact figure a quick one must not be
MISJUDGED = 1.2  # exact over quick figures, from which on the quick ones say nothing of campaigns alike
SEARCHED = "the search"  # as a stage that may be cut short
KEPT = 1.0 + 1e-6  # of a limit
QUICK = 16_000, 1000, 60  # sets, campaigns, and of these by exact figures, of a proof nobody waits for
LONG = 2_000_000, 2_000_000, 2_000_000


@dataclass(frozen=True)
class Found:
    """The campaign, its steps, what it promises exactly, and how much shorter another one could be.

    judge: by quick figures that meet the exact ones of this campaign, at the asked confidence
    spread_factors: (requirements,) times which figures hold with it over spreads that are estimates
    total_bound: of the weighted total with waiting and loads, None: the work's own; by_total: chosen for it
    """

    offers: Offers
    judge: Judge
    counts: Array
    visits: tuple[TestVisits, ...]
    timeline: tuple[Step, ...]
    foreseen: Foreseen
    spread_factors: Array
    bound: float
    proved: bool
    total_bound: float | None = None
    by_total: bool = False

    @property
    def cost(self) -> float:
        """Weighted seconds of one batch's work."""
        return float(self.offers.cost(self.counts[None])[0])


class _Kept(NamedTuple):
    """A campaign (g,) that keeps the promise exactly, the judge that meets its figures; these, if at hand."""

    counts: Array
    judge: Judge
    exact: Foreseen | None = None


def campaign_found(flight: Flight, *, effort: Literal["brief", "usual", "thorough"] = "usual") -> Found:
    """The shortest campaign found that keeps every requirement exactly, with a bound for all others.

    effort: brief looks at few campaigns and bounds nothing, thorough may prove for `plan.time_limit`.
    What hands made altogether is only foreseen.
    Raises InfeasibleError (what binds, nearest limit) when nothing on offer keeps the promise, InputError
    when no record tells something that flies.
    """
    offers, promise = on_offer(flight)
    late = flight.deadline.stops(SEARCH, SEARCHED)
    judge = Judge(promise, allowed=condition_of(flight, promise), late=late)
    if is_hand_made(flight.spec):
        counts = even(offers, 1)
        if not np.all(np.isfinite(promise.figures(counts[None]))):
            raise untold(judge, [counts], "the campaign that is fixed by hand does not tell")
        refuse_what_only_cancels(promise, counts)
        cost = float(offers.cost(counts[None])[0])
        return found_of(flight, offers, judge, counts, cost, proved=True)
    counts, judge, exact = _searched(flight, offers, judge, BRIEFLY if effort == "brief" else LOOKED_AT)
    if effort == "brief":
        return found_of(flight, offers, judge, counts, exact=exact)
    thorough, late = effort == "thorough", flight.deadline.stops(BOUND, "the bound")
    far = Effort(*(LONG if thorough else QUICK), late, thorough)
    prover = Prover(flight, offers, judge, lambda n: keeps_exactly(flight, offers, judge, n))
    bounded = prover.bounded(counts, far)
    known = exact if np.array_equal(bounded.best, counts) else None
    return found_of(flight, offers, judge, bounded.best, bounded.bound, proved=bounded.proved, exact=known)


def _searched(flight: Flight, offers: Offers, judge: Judge, most: int) -> _Kept:
    """The shortest campaign that keeps every requirement exactly, with the judge of quick figures then.

    Where no search by quick figures ends at one, the campaigns by which a refusal would name the nearest
    limits are asked exactly: what they keep is not refused.
    """
    # drawn curves make much the same of quantiles for all; quick ones are up to a sixth too large
    even_ones = beginnings(offers, judge)[:1]
    near = [] if even_ones else nearest(flight, offers, judge)
    begun, closer = _begun(flight, offers, judge, even_ones or near[:1])
    best, closer = _shortened(flight, offers, closer, most, begun, anew=True)
    if best is not None:
        return best
    near = near or nearest(flight, offers, judge)  # whatever was searched: a limit once named holds
    begun, judge = _begun(flight, offers, judge, near)
    if begun is None:
        near = [eased(flight, offers, judge, near[0]), *near[1:]]
        begun, judge = _begun(flight, offers, judge, near[:1])
    if begun is None:
        raise refusal(flight, offers, closer, near)
    return _shortened(flight, offers, judge, most, begun, anew=False)[0] or begun


def _begun(
    flight: Flight, offers: Offers, judge: Judge, starts: Sequence[Array]
) -> tuple[_Kept | None, Judge]:
    """The first of the campaigns that keeps the promise exactly; and the judge that meets the last asked."""
    for start in starts:
        quick = judge.promise.figures(start[None])[0]
        if not np.all(np.isfinite(quick)):
            continue
        visits = offers.visits(start)
        figures = unseen_figures(flight, visits)
        judge = judge.meeting(figures / quick)
        if is_kept(flight, figures, spread_factors(flight, visits)) and judge.allowed(start):
            return _Kept(start, judge), judge
    return None, judge


def _shortened(
    flight: Flight, offers: Offers, judge: Judge, most: int, begun: _Kept | None, *, anew: bool
) -> tuple[_Kept | None, Judge]:
    """The shortest campaign found that keeps the promise exactly, at worst the one that was begun with.

    Quick figures are drawn to the exact ones of the campaign found last; what breaks the promise makes the
    judge stricter and is searched again, what keeps it with room goes downhill from where it is.
    anew: whether to look for other beginnings first
    """
    best, missed = None if anew else begun, None
    for _ in range(ROUNDS):
        if (best or begun) and judge.late():
            break
        counts = shortest(offers, judge, most) if best is None else shorter(offers, judge, best.counts, most)
        if counts is None or (best is not None and not _cheaper(offers, counts, best.counts)):
            break
        kept, closer = _asked(flight, offers, judge, counts)
        if kept is not None:
            best, judge = kept, kept.judge
            flight.deadline.report(float(offers.cost(counts[None])[0]))
            continue
        missed = counts
        if np.any(closer > MISJUDGED * judge.tightened):  # what quick figures cannot see: ask exact ones
            judge = replace(judge, exactly=_exactly(flight, offers, judge), asked=0)
        else:
            judge = judge.meeting(np.maximum(judge.tightened, closer))
    if best is None and begun is not None and missed is not None:
        best = _mended(flight, offers, judge.quick(), missed, begun)
    return best or begun, judge


def _asked(flight: Flight, offers: Offers, judge: Judge, counts: Array) -> tuple[_Kept | None, Array]:
    """A campaign, if it keeps the promise exactly, and what draws quick figures to its exact ones."""
    visits = offers.visits(counts)
    exact, factors = unseen(flight, visits), spread_factors(flight, visits)
    closer = exact.figures * factors / judge.promise.figures(counts[None])[0] * CLOSER
    kept = is_kept(flight, exact.figures, factors)
    return (_Kept(counts, judge.meeting(closer), exact) if kept else None), closer


def _mended(flight: Flight, offers: Offers, judge: Judge, missed: Array, begun: _Kept) -> _Kept | None:
    """A campaign that misses its limits, made more often until it keeps them, if that is shorter.

    Where the time is over before a search ends well, what was begun with may be all repeats of all tests.
    """
    for _ in range(ROUNDS):
        counts = enough(offers, judge, missed)
        if counts is None or not _cheaper(offers, counts, begun.counts):
            return None
        kept, closer = _asked(flight, offers, judge, counts)
        if kept is not None:
            return kept
        judge = judge.meeting(np.maximum(judge.tightened, closer))
    return None


def _exactly(flight: Flight, offers: Offers, judge: Judge) -> Callable[[Array], bool]:
    """Whether campaigns keep every requirement by exact figures; each is asked once."""
    known: dict[bytes, bool] = {}

    def kept(n: Array) -> bool:
        key = n.tobytes()
        if key not in known:
            known[key] = keeps_exactly(flight, offers, judge, n)
        return known[key]

    return kept


def _cheaper(offers: Offers, n: Array, than: Array) -> bool:
    first, second = offers.cost(np.array([n, than]))
    return bool(first < second - EASIER)


def keeps_exactly(flight: Flight, offers: Offers, judge: Judge, counts: Array) -> bool:
    """Whether a campaign keeps every requirement by its exact figures, times its factors for spreads.

    Most of those that are asked break it by far under the first family: no figures are looked for then.
    """
    visits = offers.visits(counts)
    if tuple(visits) not in flight.foreseen and broken_by_far(flight, visits, judge.worst_first(counts)):
        return False
    figures = unseen_figures(flight, visits)
    return is_kept(flight, figures, np.ones(1)) and is_kept(flight, figures, spread_factors(flight, visits))


def is_kept(flight: Flight, figures: Array, factors: Array) -> bool:
    """Whether every exact figure, times its factor for spreads that are estimates, is within its limit."""
    return bool(np.all(figures * factors <= flight.limits * KEPT))


def condition_of(flight: Flight, promise: Promise) -> Callable[[Array], bool]:
    """Further conditions on a campaign: that a linear combination tells what flies, and it can lose a record.

    The first only where the most records keep it, the second unless the spec lowers that.
    """
    most = np.full(len(promise.kinds.kinds), float(flight.spec.plan.repeats.most))
    linear = leaves_products_small(promise, most)
    safe = flight.spec.plan.redundancy > 0
    return lambda n: (
        (not linear or leaves_products_small(promise, n)) and (not safe or survives_any_loss(promise, n))
    )


def found_of(
    flight: Flight,
    offers: Offers,
    judge: Judge,
    counts: Array,
    bound: float = 0.0,
    *,
    proved: bool = False,
    exact: Foreseen | None = None,
) -> Found:
    """A campaign with its steps and its exact promise, if known; bound: what none can be shorter than."""
    visits = offers.visits(counts)
    laid = laid_out(flight, visits)
    exact = exact or foreseen(flight.unseen, laid)
    factors = spread_factors(flight, visits)
    closer = exact.figures / judge.promise.figures(counts[None])[0]
    meets = replace(judge.quick().meeting(closer * factors), late=never)
    return Found(offers, meets, counts, visits, laid, exact, factors, bound, proved)
