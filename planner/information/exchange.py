"""The shortest campaign that keeps the promise, by exchange: downhill from several beginnings, then kicked.

Cost comes first, the load (the largest share of a limit that is used) second: steps that cost nothing and
ease the promise open the way to steps that save. The same arguments give the same campaign.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from planner.information.distinct import distinct
from planner.information.easiest import EASIER, MOST_STEPS, easiest
from planner.information.even import MOST_TEMPERATURES, even
from planner.information.neighbours import Neighbours
from planner.information.offers import Offers
from planner.information.promise import Promise
from planner.nouns.array import Array
from planner.nouns.deadline import never

CHUNK = 48  # campaigns that are evaluated together
FEW = 6  # of which it is faster to ask all families at once
DROPPED = 4  # beginnings of a way through the limit


def _anything(n: Array) -> bool:
    del n
    return True


@dataclass
class Judge:
    """Who says whether campaigns keep the promise. families: those that have decided anything so far.

    tightened: (families, requirements) by what quick figures are multiplied to meet exact ones
    allowed: further conditions on one campaign, such as redundancy; late: whether to stop looking
    exactly: whether a campaign keeps its limits by exact figures, where quick ones misjudge it
    broken: family -> campaigns that it was first to say of that they break the promise
    """

    promise: Promise
    tightened: Array = field(default_factory=lambda: np.ones((1, 1)))
    allowed: Callable[[Array], bool] = _anything
    families: list[str] = field(default_factory=list)
    asked: int = 0
    late: Callable[[], bool] = never
    exactly: Callable[[Array], bool] = _anything
    broken: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self.families = self.families or [next(iter(self.promise.families))]
        shape = (len(self.promise.families), len(self.promise.asked))
        self.tightened = np.broadcast_to(self.tightened, shape)

    def loads(self, counts: Array, families: list[str] | None = None) -> Array:
        """(B,) loads under the families that have decided so far, or those that are named."""
        self.asked += len(counts)
        figures = self.promise.known_figures(counts, families or self.families)
        return np.asarray(self._by_family(figures, families or self.families).max(axis=1))

    @property
    def _strictest_first(self) -> list[str]:
        """The families that have decided, by how often one was the first to."""
        return sorted(self.families, key=lambda name: -self.broken[name])

    def by_family(self, counts: Array, families: Sequence[str]) -> Array:
        """(B, families) loads, in the promise's order of the families."""
        self.asked += len(counts)
        return self._loads(counts, families)

    def worst_first(self, n: Array) -> list[str]:
        """The families by the load of one campaign (g,), the largest first."""
        loads = self._loads(n[None], [*self.promise.families])[0]
        return [[*self.promise.families][i] for i in np.argsort(-loads, kind="stable")]

    def _loads(self, counts: Array, families: Sequence[str]) -> Array:
        return self._by_family(self.promise.figures(counts, families), families)

    def _by_family(self, figures: Array, families: Sequence[str]) -> Array:
        asked = [i for i, name in enumerate(self.promise.families) if name in families]
        limits = np.array([a.limit for a in self.promise.asked])
        return np.asarray((figures * self.tightened[asked] / limits).max(axis=2))

    def keep(self, counts: Array) -> NDArray[np.bool_]:
        """(B,) whether campaigns keep the promise under the families that have decided so far."""
        self.asked += len(counts)
        if len(counts) <= FEW:
            return self._within(counts, self.families)
        left = np.arange(len(counts))
        for name in self._strictest_first:
            kept = self._within(counts[left], [name])
            self.broken[name] += int(np.sum(~kept))
            left = left[kept]
            if not len(left):
                break
        return np.isin(np.arange(len(counts)), left)

    def _within(self, counts: Array, families: Sequence[str]) -> NDArray[np.bool_]:
        limits = np.array([a.limit for a in self.promise.asked])
        asked = [i for i, name in enumerate(self.promise.families) if name in families]
        return self.promise.within(counts, limits / self.tightened[asked], families)

    def figures(self, counts: Array) -> Array:
        """(B, requirements) the largest over all families, SI."""
        return np.asarray((self.promise.figures(counts) * self.tightened).max(axis=1))

    def meeting(self, tightened: Array) -> Judge:
        """The same judge with other factors between quick and exact figures."""
        return replace(self, tightened=tightened, families=list(self.families), asked=0)

    def loosened(self, factor: float) -> Judge:
        """The same judge of limits that are so many times as wide."""
        return self.meeting(self.tightened / factor)

    def quick(self) -> Judge:
        """The same judge by quick figures alone: for limits that are not the spec's, or that count later."""
        return replace(self, families=list(self.families), exactly=_anything)

    @property
    def hurries(self) -> bool:
        """Whether time is over for a search that asks exact figures, which has something to fall back on."""
        return self.exactly is not _anything and self.late()

    def keeps(self, n: Array) -> bool:
        """Whether a campaign that keeps it so far keeps it under every family; what breaks it stays.

        Those that have decided are asked as well: one may have joined them since they were.
        """
        if not self._within(n[None], self.families)[0]:
            return False
        left = [f for f in self.promise.families if f not in self.families]
        if left:
            self.asked += 1
            broken = self._loads(n[None], left)[0] > 1.0
            if broken.any():
                self.families.append(left[int(np.argmax(broken))])
                self.broken[self.families[-1]] += 1
                return False
        return self.allowed(n) and self.exactly(n)


def shortest(offers: Offers, judge: Judge, most: int) -> Array | None:
    """(g,) counts of the shortest campaign found, None if none keeps the promise; most: to look at."""
    best: Array | None = None
    least, seen = np.inf, set[tuple[tuple[str, bool], ...]]()
    for start in beginnings(offers, judge) or one_that_keeps(offers, judge):
        if best is not None and judge.asked > most and _ways(offers, start) in seen:
            continue
        seen.add(_ways(offers, start))
        found = downhill(offers, judge, start)
        cost = float(offers.cost(found[None])[0])
        if cost < least - EASIER:
            best, least = found, cost
        if judge.late():
            break
    return None if best is None else shorter(offers, judge, best, most)


def _ways(offers: Offers, n: Array) -> tuple[tuple[str, bool], ...]:
    """The tests of a campaign, and whether each is made at more than one temperature.

    Downhill hardly leads from one such way of calibrating to another: the shortest of each begins.
    """
    visits = [(o.test, int(np.count_nonzero(n[o.places]))) for o in offers.tests]
    return tuple((test, many > 1) for test, many in visits if many)


def beginnings(offers: Offers, judge: Judge) -> list[Array]:
    """Campaigns that keep the promise, the shortest first: tests at N even temperatures, enough repeats.

    Every test at all of them, or one test at all and the others at one. Where none of few keeps it, as
    flights that count at the ends of the range may ask, at every temperature that is on offer.
    """
    chosen = [o for o in offers.tests if not o.everywhere and o.fixed is None]
    mains = (None, *(o.test for o in chosen)) if len(chosen) > 1 else (None,)
    found: list[Array] = []
    for N in range(1, MOST_TEMPERATURES + 1) if chosen else (1,):
        for main in mains if N > 1 else (None,):
            found += _enough_of(offers, judge, even(offers, N, main))
        if judge.hurries or (found and judge.late()):
            break
    if chosen and not found and not judge.hurries:
        most = max(len(o.places) for o in chosen)
        found = [n for main in mains for n in _enough_of(offers, judge, even(offers, most, main, inset=0.0))]
    return sorted(found, key=lambda n: float(offers.cost(n[None])[0]))


def _enough_of(offers: Offers, judge: Judge, n: Array) -> list[Array]:
    """The campaign, and its part on each bench, with enough repeats where these keep the promise."""
    each = [enough(offers, judge, some) for some in (n, *_on_one_bench(offers, n))]
    return [found for found in each if found is not None]


def _on_one_bench(offers: Offers, n: Array) -> list[Array]:
    """The campaign without the tests of all benches but one, where none of these is fixed by hand."""
    of_kind = np.array([offers.spec.tests[k.test].bench for k in offers.kinds])
    free = np.zeros(len(n), dtype=bool)
    for offer in offers.tests:
        free[offer.places] = offer.fixed is None
    benches = dict.fromkeys(of_kind.tolist())
    alone = [np.where((of_kind == bench) | ~free, n, 0.0) for bench in benches] if len(benches) > 1 else []
    return [some for some in alone if np.any(some > 0)]


def one_that_keeps(offers: Offers, judge: Judge) -> list[Array]:
    """A campaign that keeps the promise, where none at even temperatures does; none where none is found."""
    if judge.hurries:
        return []
    every = [*judge.promise.families]
    n = easiest(offers, judge.by_family, every, judge.late, enough=1.0)
    return [n] if judge.loads(n[None], every)[0] <= 1.0 and judge.keeps(n) else []


def enough(offers: Offers, judge: Judge, n: Array) -> Array | None:
    """The campaign with repeats multiplied until it keeps the promise; None if none of them does."""
    most = np.zeros(len(n))
    fixed = np.zeros(len(n), dtype=bool)
    for offer in offers.tests:
        most[offer.places] = offer.most
        fixed[offer.places] = offer.fixed is not None
    levels = np.unique(np.round(1.5 ** np.arange(0, 24)))
    if judge.loads(np.where(fixed, n, np.minimum(n * levels[-1], most))[None])[0] > 1.0:
        return None  # nor do fewer
    every = distinct([np.where(fixed, n, np.minimum(n * k, most)) for k in levels])
    every = every[np.argsort(offers.cost(every), kind="stable")]
    while True:
        loads = judge.loads(every)
        good = np.flatnonzero(loads <= 1.0)
        if not len(good) or judge.hurries:
            return None
        if judge.keeps(every[good[0]]):
            return np.asarray(every[good[0]])
        every = every[good[1:]] if not judge.loads(every[good[:1]])[0] > 1.0 else every[good[0] :]
        if not len(every):
            return None


def downhill(offers: Offers, judge: Judge, n: Array) -> Array:
    """Steps to cheaper campaigns that keep the promise, or as cheap ones that keep it more easily."""
    moves = Neighbours(offers)
    load = float(judge.loads(n[None])[0])
    for _ in range(MOST_STEPS):
        if judge.late():
            return n
        step = _step(offers, judge, moves, n, load)
        if step is None:
            return n
        n, load = step
    return n


def _step(
    offers: Offers, judge: Judge, moves: Neighbours, n: Array, load: float
) -> tuple[Array, float] | None:
    near = moves.of(n)
    cost, own = offers.cost(near), float(offers.cost(n[None])[0])
    cheaper = near[cost < own - EASIER]
    found = _first(judge, cheaper[np.argsort(cost[cost < own - EASIER], kind="stable")])
    if found is not None:
        return found, float(judge.loads(found[None])[0])
    alike = near[np.abs(cost - own) <= EASIER]
    if not len(alike):
        return None
    loads = judge.loads(alike)
    best = int(np.argmin(loads))
    if loads[best] < min(load, 1.0) - 1e-4 and judge.keeps(alike[best]):
        return alike[best], float(loads[best])
    return None


def _first(judge: Judge, ordered: Array) -> Array | None:
    """The first of the campaigns that keeps the promise."""
    for start in range(0, len(ordered), CHUNK):
        if judge.late():
            return None
        some = ordered[start : start + CHUNK]
        for i in np.flatnonzero(judge.keep(some)):
            if judge.keeps(some[i]):
                return np.asarray(some[i])
    return None


def shorter(offers: Offers, judge: Judge, n: Array, most: int) -> Array:
    """A campaign that is as short as one that keeps the promise, or shorter; most: to look at."""
    best = downhill(offers, judge, n)
    while not judge.late():
        found = _through_the_limit(offers, judge, best)
        if found is None:
            break
        best = downhill(offers, judge, found)
    return _kicked(offers, judge, best, most)


def _through_the_limit(offers: Offers, judge: Judge, best: Array) -> Array | None:
    """A cheaper campaign that keeps the promise, by way of some that do not; None where none is found.

    Something is left out, and what remains is made to load the promise less as long as it stays cheaper: with
    a temperature fewer the others want other places and more repeats at once, which no single step finds.
    """
    moves, below = Neighbours(offers), float(offers.cost(best[None])[0]) - EASIER
    fewer = moves.fewer(best)
    fewer = fewer[offers.cost(fewer) < below]
    for i in np.argsort(judge.loads(fewer), kind="stable")[:DROPPED] if len(fewer) else ():
        found = eased(offers, judge, fewer[i], below)
        if found is not None:
            return found
    return None


def eased(offers: Offers, judge: Judge, n: Array, below: float = np.inf) -> Array | None:
    """The first campaign cheaper than `below` on the steepest way from n that keeps the promise."""
    moves, load = Neighbours(offers), float(judge.loads(n[None])[0])
    for _ in range(MOST_STEPS):
        near = np.concatenate([moves.of(n), moves.more(n)])
        near = near[offers.cost(near) < below]
        if not len(near) or judge.late():
            return None
        loads = judge.loads(near)
        keeping = np.flatnonzero(loads <= 1.0)
        for i in keeping[np.argsort(offers.cost(near[keeping]), kind="stable")]:
            if judge.keeps(near[i]):
                return np.asarray(near[i])
        steepest = int(np.argmin(loads))
        if not loads[steepest] < load * (1.0 - EASIER):
            return None
        n, load = near[steepest], float(loads[steepest])
    return None


def _kicked(offers: Offers, judge: Judge, best: Array, most: int) -> Array:
    """The best shaken, or with records added at random, and taken downhill, as long as campaigns are left."""
    rng = np.random.default_rng(0)
    moves = Neighbours(offers)
    while judge.asked < most and not judge.late():
        shaken = moves.shaken(best, CHUNK, rng)
        kept = shaken[judge.keep(shaken)] if len(shaken) else shaken
        more = moves.more(best)
        if not len(kept) and not len(more):
            return best
        starts = [kept[np.argmin(offers.cost(kept))]] if len(kept) else []
        starts += [more[rng.integers(len(more))]] if len(more) else []
        for start in starts:
            found = downhill(offers, judge, start)
            if judge.keeps(found) and offers.cost(found[None])[0] < offers.cost(best[None])[0] - EASIER:
                best = found
    return best
