"""What no campaign can be shorter than, and, where the remaining ones can be counted, that none is.

A set of temperatures from which even perfect knowledge of the curves breaks a requirement is no campaign
(`perfect_knowledge`); the others cost at least their soaks, ramps and the fewest records. Sets are looked at
by their number of temperatures, the fewest first; a number that is not looked at counts with the cheapest of
its sets. Where few campaigns cost less than the best one found, all of them are asked: then it is proved, or
a shorter one is found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain, combinations, islice
from math import comb

import numpy as np
from numpy.typing import NDArray

from planner.information.easiest import EASIER
from planner.information.even import most_repeats
from planner.information.exchange import CHUNK, Judge
from planner.information.model_of import Flight
from planner.information.offers import Offer, Offers
from planner.information.perfect_knowledge import DRAWN, PerfectKnowledge
from planner.nouns.array import Array
from planner.nouns.deadline import never

Set = tuple[int, ...]  # places of the grid
SETS_AT_ONCE = 500
MOST_SETS_OF_TESTS = 1023  # of ten tests beside one: every set of them
LEVELS = 8  # of price, up to the best campaign: of each all are listed, and asked
STEPS = 20  # of the count for every campaign that may be asked
NEARLY = 1.03  # by the quick figure, whose curves' moments are known to 2 %: then the exact one is asked
UNPRICED = ("_needed", "_knowledge", "_plain")


@dataclass(frozen=True)
class Effort:
    """How far a proof goes. sets: of temperatures looked at; campaigns: asked one by one; late: to stop

    exact: campaigns of which the exact figure is asked; patient: also where these will not be all
    """

    sets: int
    campaigns: int
    exact: int
    late: Callable[[], bool] = never
    patient: bool = False


@dataclass(frozen=True)
class Bounded:
    """bound: weighted seconds; proved: no campaign on offer costs less than `best`; best: (g,) counts"""

    bound: float
    proved: bool
    best: Array


@dataclass(frozen=True)
class Prover:
    """Everything that a bound asks: the exact requirements, what is on offer, and who judges campaigns.

    exactly: whether one campaign (g,) keeps the promise by the exact figures
    """

    flight: Flight
    offers: Offers
    judge: Judge
    exactly: Callable[[Array], bool]

    def priced(self, offers: Offers) -> Prover:
        """The same with other prices; what does not depend on them is handed on."""
        other = replace(self, offers=offers)
        other.__dict__.update({name: self.__dict__[name] for name in UNPRICED if name in self.__dict__})
        return other

    def bounded(self, best: Array, effort: Effort) -> Bounded:
        """A bound of every campaign on offer that keeps the promise; a shorter campaign if one is met."""
        cost = float(self.offers.cost(best[None])[0])
        survivors, beyond = self.survivors(cost, effort)
        bound = min([*(floor for floor, _ in survivors), beyond, cost])
        return self._counted(sorted(survivors), bound, beyond, best, effort)

    # ------------------------------------------------------------ sets of temperatures

    def survivors(self, cost: float, effort: Effort) -> tuple[list[tuple[float, Set]], float]:
        """(floor, set) of all that cost less and may keep the promise; the least of those not looked at."""
        found: list[tuple[float, Set]] = []
        T, left = len(self._grid), effort.sets
        for size in range(0 if self._in_the_room else 1, T + 1):
            if np.sort(self._own)[:size].sum() >= cost - EASIER:
                return found, np.inf
            if self._least_floor(size) >= cost - EASIER:
                continue
            if comb(T, size) > left or effort.late():
                return found, min(self._least_floor(more) for more in range(size, T + 1))
            left -= comb(T, size)
            self.flight.deadline.report(cost, partial(self._below, found, size))
            sets = np.array(list(combinations(range(T), size)), dtype=np.intp).reshape(comb(T, size), size)
            floors = self._floors(sets)
            sets, floors = sets[floors < cost - EASIER], floors[floors < cost - EASIER]
            for start in range(0, len(sets), SETS_AT_ONCE):
                if effort.late():
                    return found, min(self._least_floor(more) for more in range(size, T + 1))
                some = sets[start : start + SETS_AT_ONCE]
                good = start + np.flatnonzero(self._knowledge.may_do(some, self._plain.tightened))
                found += [(float(floors[i]), tuple(map(int, sets[i]))) for i in good]
        return found, np.inf

    def _below(self, found: Sequence[tuple[float, Set]], size: int) -> float:
        """What nothing can cost less than while sets of `size` temperatures and more are not looked at."""
        more = range(size, len(self._grid) + 1)
        return min([*(floor for floor, _ in found), *map(self._least_floor, more)], default=0.0)

    # ------------------------------------------------------------ what a set costs at least

    def _least_floor(self, size: int) -> float:
        """The least that any set of so many temperatures costs.

        Where the same is on offer at each of them, it is one of neighbours, wherever it lies; else its
        temperatures cost what is paid for each alone.
        """
        T = len(self._grid)
        if self._uniform or size == 0:
            runs = np.array([[*range(i, i + size)] for i in range(T - size + 1)], dtype=np.intp)
            return float(self._floors(runs.reshape(T - size + 1, size)).min(initial=np.inf))
        return float(np.sort(self._own)[:size].sum() + self._of_sets(np.empty((1, 0), dtype=np.intp))[0])

    def _floors(self, sets: NDArray[np.intp]) -> Array:
        """(B,) weighted seconds that a campaign at sets (B, K) costs at least."""
        floors = self._of_sets(sets)
        return floors if sets.shape[1] else np.maximum(floors, self._room_floor)

    def _of_sets(self, sets: NDArray[np.intp]) -> Array:
        """(B,) the same by what is soaked.

        Soaks and ramps of the set, the cheapest test at each of its temperatures, every test without which
        something that flies is undetermined: at one of them in the place of the cheapest, or in the room.
        """
        offers, (used_once, price) = self.offers, self.offers.wherever
        once = np.zeros((len(sets), len(price)), dtype=bool)
        here = (sets[:, :, None] == np.arange(len(self._grid))).any(axis=1)
        total = here @ self._cheapest
        for t, used in enumerate(self._paid_once):
            once[here[:, t]] |= used
        for offer in self._needed:
            once |= used_once[offer.places].all(axis=0)
            least = np.array([self._least(int(k)) for k in offer.places])
            if not offers.soaked[offer.places[0]]:
                total += least.min()
                continue
            places = np.searchsorted(self._grid, offers.degc[offer.places])
            instead = np.where(here[:, places], least - self._cheapest[places], np.inf).min(axis=1)
            total += np.where(np.isfinite(instead), instead, 0.0)
        return np.asarray(total + once @ price)

    @cached_property
    def _cheapest(self) -> Array:
        """(T,) what the cheapest test at each temperature costs."""
        return np.array([min(self._least(k) for k in kinds) for kinds in self._at])

    @cached_property
    def _paid_once(self) -> NDArray[np.bool_]:
        """(T, R) what every campaign at a temperature pays once, and what it may save there."""
        once, price = self.offers.wherever
        paid = [once[kinds].all(axis=0) | s for kinds, s in zip(self._at, self._saved, strict=True)]
        return np.array(paid, dtype=bool).reshape(len(self._at), len(price))

    @cached_property
    def _own(self) -> Array:
        """(T,) what a temperature costs at least beside all others."""
        alone = self._paid_once & (self._paid_once.sum(axis=0) == 1)
        return np.asarray(self._cheapest + alone @ self.offers.wherever[1])

    @cached_property
    def _uniform(self) -> bool:
        """Whether the same tests are on offer at every temperature, for the same price."""
        return (
            len({tuple((self._offer_of[k].test, self._least(k)) for k in kinds) for kinds in self._at}) <= 1
        )

    def _least(self, kind: int) -> float:
        offer = self._offer_of[kind]
        return float(offer.fewest * self.offers.each_price[kind])

    @cached_property
    def _needed(self) -> tuple[Offer, ...]:
        """Tests without which something that flies is undetermined, however often others are made.

        Any of the others: a test that tells a node of a table too little leaves it undetermined.
        """
        tests = self.offers.tests
        return tuple(o for o in tests if o.fixed is not None or not self._do_without(o, tests))

    def _do_without(self, offer: Offer, tests: Sequence[Offer]) -> bool:
        """Whether some of the others tell all that flies; the most of them are asked first.

        So many others have more sets than can be asked: then the test counts as one that may be left out.
        """
        others = [o for o in tests if o is not offer]
        sizes = range(len(others), 0, -1)
        sets = chain.from_iterable(combinations(others, size) for size in sizes)
        asked = islice(sets, MOST_SETS_OF_TESTS)
        while some := [*islice(asked, CHUNK)]:
            counts = np.zeros((len(some), len(self.offers.kinds)))
            for row, made in zip(counts, some, strict=True):
                for o in made:
                    row[o.places] = 1.0
            if not np.all(self.judge.promise.left(counts)[1]):
                return True
        return next(sets, None) is not None

    @cached_property
    def _in_the_room(self) -> tuple[Offer, ...]:
        """The tests that need no soak; none where they cannot tell all that flies, made ever so often."""
        n = most_repeats(self.offers, np.where(self.offers.soaked, 0.0, 1.0))
        if not np.any(n > 0) or self.judge.promise.left(n[None])[1][0]:
            return ()
        return tuple(o for o in self.offers.tests if not self.offers.soaked[o.places[0]])

    @cached_property
    def _room_floor(self) -> float:
        """What a campaign without any soak costs at least: those of its tests that all others miss, or one.

        Beside tests that soak none of them may be missed; it was taken for a campaign that costs nothing.
        """
        room = self._in_the_room
        if not room:
            return 0.0
        needed = [o for o in room if not self._do_without(o, room)]
        return self._made(needed) if needed else min(self._made([o]) for o in room)

    def _made(self, tests: Sequence[Offer]) -> float:
        """What tests cost at least when each is made somewhere, with all that may be saved."""
        once, price = self.offers.wherever
        paid = np.any([once[o.places].all(axis=0) for o in tests], axis=0) | (price < 0.0)
        return float(sum(min(map(self._least, o.places.tolist())) for o in tests) + paid @ price)

    @cached_property
    def _at(self) -> list[list[int]]:
        """Kinds at each temperature of the grid."""
        soaked, degc = self.offers.soaked, self.offers.degc
        return [[int(k) for k in np.flatnonzero(soaked & (degc == t))] for t in self._grid]

    @cached_property
    def _saved(self) -> list[NDArray[np.bool_]]:
        """What may be saved at each temperature: resources of a negative price, whichever test uses them."""
        once, price = self.offers.wherever
        return [once[kinds].any(axis=0) & (price < 0) for kinds in self._at]

    # ------------------------------------------------------------ one by one

    def _counted(
        self, survivors: Sequence[tuple[float, Set]], bound: float, beyond: float, best: Array, effort: Effort
    ) -> Bounded:
        """The shortest of all campaigns at the sets that are left, as far up as they can be asked.

        survivors: the cheapest first; beyond: what sets that were not looked at cost at least. Campaigns are
        listed level by level, and each level raises the bound; those that quick figures do not refuse are
        asked exactly as soon as all are listed, or before where the proof has time.
        """
        cost = float(self.offers.cost(best[None])[0])
        top, asked, waiting = min(beyond, cost), 0, list[tuple[float, Array]]()
        for level in np.linspace(bound, top, LEVELS + 1)[1:].tolist() if bound < top else ():
            every = self._between(survivors, bound, min(level, cost - EASIER), effort)
            if every is None:
                break
            near = self._not_refused(every, effort)
            if near is None:
                break
            waiting += near
            asked += len(near)
            bound = level
            if asked > effort.exact:
                break
            if effort.patient or level >= cost - EASIER:
                for price, n in waiting:
                    if effort.late():
                        return Bounded(price, False, best)
                    if self.judge.allowed(n) and self.exactly(n):
                        return Bounded(price, True, n)
                waiting = []
        if bound >= cost - EASIER:
            return Bounded(cost, True, best)
        return Bounded(min([bound, *(price for price, _ in waiting)]), False, best)

    def _not_refused(self, every: Array, effort: Effort) -> list[tuple[float, Array]] | None:
        """Those of campaigns (B, g) that quick figures do not refuse, with prices; None where it is late."""
        drawn = any(a.share is not None for a in self.judge.promise.asked)
        nearly, near = NEARLY * (DRAWN if drawn else 1.0), list[tuple[float, Array]]()
        for start in range(0, len(every), CHUNK):
            if effort.late():
                return None
            some = every[start : start + CHUNK]
            some = some[self._plain.loads(some) <= nearly]
            near += zip(self.offers.cost(some).tolist(), some, strict=True)
        return near

    def _between(
        self, survivors: Sequence[tuple[float, Set]], least: float, most: float, effort: Effort
    ) -> Array | None:
        """(B, g) all campaigns that cost at least one price and less than another, the cheapest first.

        None where they are too many.
        """
        found: list[Array] = []
        for floor, some in survivors:
            if floor >= most:
                break
            for n in self._campaigns(some, most, effort):
                if n is None or len(found) > effort.campaigns or (len(found) % 1000 == 999 and effort.late()):
                    return None
                found.append(n)
        every = np.array(found).reshape(-1, len(self.offers.kinds))
        prices = self.offers.cost(every)
        inside = np.flatnonzero((prices >= least - EASIER) & (prices < most))
        return every[inside[np.argsort(prices[inside], kind="stable")]]

    def _campaigns(self, some: Set, cost: float, effort: Effort) -> Iterator[Array | None]:
        """All campaigns at exactly these temperatures that may cost less; None when they are too many.

        Tests in the room are among them; what a set pays once it pays whatever is made there.
        """
        offers, steps = self.offers, 0
        kinds = [k for t in some for k in self._at[t]] + np.flatnonzero(~offers.soaked).tolist()
        groups = [frozenset(self._at[t]) for t in some]
        once = self._paid_once[list(some)].any(axis=0)
        slack = cost - float(once @ offers.wherever[1])
        ways = [[0, *_repeats(self._offer_of[k])] for k in kinds]
        price = [float(offers.each_price[k]) for k in kinds]
        made = [0] * len(kinds)
        stack = [(0, 0.0, iter(ways[0]))] if kinds else []
        while stack:
            place, spent, left = stack[-1]
            repeats = next(left, None)
            steps += 1
            if steps > STEPS * effort.campaigns:
                yield None
                return
            if repeats is None or spent + repeats * price[place] >= slack:
                made[place] = 0
                stack.pop()
                continue
            made[place] = repeats
            if place + 1 < len(kinds):
                stack.append((place + 1, spent + repeats * price[place], iter(ways[place + 1])))
                continue
            n = np.zeros(len(offers.kinds))
            n[kinds] = made
            if np.any(n) and all(any(n[k] > 0 for k in group) for group in groups) and self._by_hand(n):
                yield n

    @cached_property
    def _plain(self) -> Judge:
        """Quick figures as they are: what one campaign's exact figure had more, another's need not have.

        Where drawn curves have a smaller quantile than Gaussian ones, another campaign's may be as small.
        """
        return self.judge.meeting(np.minimum(self.judge.tightened, 1.0))

    @cached_property
    def _offer_of(self) -> dict[int, Offer]:
        return {int(k): offer for offer in self.offers.tests for k in offer.places}

    def _by_hand(self, n: Array) -> bool:
        """Whether what hands fixed is made as they fixed it."""
        for offer in self.offers.tests:
            if offer.fixed is not None and np.any(n[offer.places] != offer.fixed):
                return False
            if offer.everywhere and np.any(n[offer.places] > 0) and np.any(n[offer.places] == 0):
                return False
        return True

    # ------------------------------------------------------------ temperatures and curves

    @cached_property
    def _knowledge(self) -> PerfectKnowledge:
        return PerfectKnowledge(self.flight, self.offers, self.judge.promise)

    @property
    def _grid(self) -> Array:
        return self._knowledge.grid


def _repeats(offer: Offer) -> Sequence[int]:
    """How often one visit of a test may be made."""
    return sorted({*offer.fixed}) if offer.fixed is not None else range(offer.least, offer.most + 1)
