"""When to recalibrate in store, and how: the shortest visit that suffices, the schedule of least hours.

The size of a term at day t, renewed last at day s to the half-width e, is e ⊕ g(s, t), with g what it moves
in between and ⊕ the sum (worst_case) or the root of the squares; T of `allowed_region` at these sizes, with
what flights add, must stay within every limit. A visit renews a term only where it leaves less than there
is.

g and the sizes at the start are those of `growth`.

Schedule: every size grows until it is renewed, so of all times for a given visit the latest at which the
limits still hold leaves no larger size at any later day. A search over visits, each made as late as it can be
(on a grid of days), in the order of their hours, keeps only states that no other beats in hours and in every
term; its first way to the end is the cheapest of all (Dijkstra 1959, Martins 1984).
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.fleet.allowed_region import ALL_AXES, PARTS, AllowedRegion, Reserve, reserve_of
from planner.fleet.forecast._method import two_sided
from planner.fleet.growth import Growth
from planner.fleet.store import StoreBench, Visit, visit_time, visits
from planner.fleet.visit_plans import ROUNDING, PlannedVisit, ShortestVisit, StorePlan
from planner.fleet.visit_states import Known, Reached, State
from planner.nouns.array import Array

STEPS = 73  # of the grid: five days in a year
NUMBERS = (*range(21), 30, 50, 100)  # power-ons that a schedule chooses from, up to the most that are allowed
_ALIKE = 1e-3  # of the limit
MOST_STATES = 15_000  # of the search; beyond them the best way so far is kept and marked


_Entry = tuple[float, int, int, float, State, tuple[tuple[int, Visit], ...]]


class StorePlanner:
    """One unit's region, growth and store, asked for visits and schedules."""

    def __init__(
        self, unit: str, region: AllowedRegion, growth: Growth, bench: StoreBench, confidence: float
    ) -> None:
        self.unit, self.region, self.growth, self.bench = unit, region, growth, bench
        self.quantile = float(two_sided(confidence, np.inf))
        self.adds = any(c.rule == "worst_case" for c in region.constraints)
        self.reserve = flying_reserve(region)
        self.first = State(growth.start, np.zeros(len(region.terms), dtype=np.int64))

    # ---------------------------------------------------------------- sizes and loads

    def sizes(self, state: State) -> Array:
        """(W, t) sizes on every day from the renewals on."""
        terms = np.arange(len(state.size))
        moved = self.growth.between[terms, state.since, :].T
        return state.size + moved if self.adds else np.hypot(state.size, moved)

    def loads(self, state: State) -> Array:
        """(W,) share of the limit."""
        return self.region.load(self.sizes(state), self.reserve)

    def renewed(self, state: State, place: int, visit: Visit) -> State:
        """The state after a visit on a day of the grid."""
        before = self.sizes(state)[place]
        after = self.quantile * self.bench.left(visit.rests, visit.turns)
        better = after < before
        return State(np.where(better, after, state.size), np.where(better, place + 1, state.since))

    def last_within(self, state: State, place: int) -> int:
        """The last day of the grid until which the limits hold from `place` on; place − 1: not even then."""
        over = np.flatnonzero(self.loads(state)[place:] > 1.0 + ROUNDING)
        return len(self.growth.days) - 1 if len(over) == 0 else place + int(over[0]) - 1

    def each(
        self, state: State, place: int, left: Array
    ) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
        """After each of C visits that leave sizes (C, t): sizes and rows of renewal (C, t), last day within
        (C,)."""
        terms = np.arange(len(state.size))
        going = self.growth.between[terms, state.since, place:]  # (t, w)
        anew = self.growth.between[:, place + 1, place:]
        before = state.size + going[:, 0] if self.adds else np.hypot(state.size, going[:, 0])
        better = left < before
        size = np.where(better, left, state.size)
        over = self._grown(size, better, going, anew) > 1.0 + ROUNDING
        end = len(self.growth.days) - 1
        last = np.where(over.any(axis=1), place + over.argmax(axis=1) - 1, end)
        return size, np.where(better, place + 1, state.since), last

    def _grown(self, size: Array, better: NDArray[np.bool_], going: Array, anew: Array) -> Array:
        """(C, w) shares of the limit of sizes (C, t) that grow (t, w) anew where a visit was better, else go
        on."""
        if self.region.power is None:
            moved = np.where(better[:, :, None], anew, going)
            sizes = size[:, :, None] + moved if self.adds else np.hypot(size[:, :, None], moved)
            return self.region.load(sizes.swapaxes(1, 2), self.reserve)
        power = self.region.power
        grown = np.concatenate([anew, going]) ** power
        kinds = np.concatenate([better, ~better], axis=1)
        shares = [
            ((size**power + self.region.flown(self.reserve)) @ w)[:, None] + (kinds * np.tile(w, 2)) @ grown
            for w in self.region.weights
        ]
        return np.asarray(np.max(shares, axis=0) ** (1 / power))

    def left_by(self, choices: Sequence[Visit]) -> Array:
        """(C, t) half-widths that visits leave."""
        return np.array([self.quantile * self.bench.left(v.rests, v.turns) for v in choices])

    # ---------------------------------------------------------------- questions

    def shortest(self, place: int, end: int) -> ShortestVisit:
        """The shortest visit on one day of the grid that suffices until another."""
        return self._shortest(place, (end,))[0]

    def _shortest(self, place: int, ends: Sequence[int]) -> list[ShortestVisit]:
        """The same for several days to be reached."""
        every = self.bench.every
        last = self.each(self.first, place, self.left_by(every))[2]
        return [self._suffices(place, int(end), every, last) for end in ends]

    def _suffices(
        self, place: int, end: int, every: Sequence[Visit], last: NDArray[np.int64]
    ) -> ShortestVisit:
        """The first of the visits that lasts until the end; last: (C,) the day until which each does."""
        state = self.first
        without = float(self.loads(state)[end])
        now, then = float(self.growth.days[place]), float(self.growth.days[end])
        enough = np.flatnonzero(last >= end)
        if len(enough):
            visit = every[int(enough[0])]
            after = self.renewed(state, place, visit)
            load = float(self.loads(after)[end])
            return ShortestVisit(self.unit, now, then, visit, without, load, self._names(state, after))
        best = self.renewed(state, place, Visit(self.bench.asked.repeats, self.bench.asked.repeats, 0.0))
        load = float(self.loads(best)[end])
        return ShortestVisit(self.unit, now, then, None, without, load, ())

    def ladder(self, rungs: int = 8) -> tuple[ShortestVisit, ...]:
        """The shortest visit, on the day when the unit is due, for later and later days to be reached."""
        due, end = max(self.last_within(self.first, 0), 0), len(self.growth.days) - 1
        if due == end:
            return ()
        ends = np.unique(np.linspace(due + 1, end, rungs).round().astype(int))
        found = self._shortest(due, [int(e) for e in ends])
        reached = [r for r in found if r.visit is not None]
        return (*reached, *found[len(reached) : len(reached) + 1])

    def schedule(self, numbers: Sequence[int] = NUMBERS) -> StorePlan:
        """The visits that cost least hours to the end of the grid, or as far as the store carries."""
        choices = self._choices(numbers)
        furthest = self._thorough()
        target = furthest.place
        known = min((furthest, *self._uniform(choices, target)), key=lambda way: way.cost)
        order = itertools.count()
        start = min(self.last_within(self.first, 0), target)
        cheapest, longest = min(v.time_s for v in choices), self._longest(choices)
        queue: list[_Entry] = [(0.0, -start, next(order), 0.0, self.first, ())]
        kept: dict[int, Known] = {}
        left_by = self.left_by(choices)
        live = self._live(left_by)
        slack = self._slack()[live]
        for _ in range(MOST_STATES):
            if not queue:
                break
            _, place, _, cost, state, way = heapq.heappop(queue)
            place = -place
            if place >= target:
                return self._plan(Reached(target, way, cost), proved=True)
            if kept.setdefault(place, Known(slack)).beats(state, live):
                continue
            sizes, since, last = self.each(state, place, left_by)
            for i in self._worth(sizes[:, live], since[:, live], last, place, slack):
                then, visit = min(int(last[i]), target), choices[i]
                total = cost + visit.time_s
                left = np.ceil((target - then) / longest) * cheapest  # no way to the end costs less
                if total + left >= known.cost and then < target:
                    continue
                after = State(sizes[i], since[i])
                item = (total + left, -then, next(order), total, after, (*way, (place, visit)))
                heapq.heappush(queue, item)
        return self._plan(known, proved=not queue)

    def _worth(
        self, size: Array, since: NDArray[np.int64], last: NDArray[np.int64], place: int, slack: Array
    ) -> NDArray[np.intp]:
        """The visits (the shortest first) that lead on, and of which no shorter one leaves as little.

        size, since: (C, t) of the terms that visits renew; so with the slack.
        """
        on = np.flatnonzero(last > place)
        size, since = size[on], since[on]
        beaten = (size[None, :, :] <= size[:, None, :] + slack) & (since[None, :, :] >= since[:, None, :])
        return on[~np.tril(beaten.all(axis=2), -1).any(axis=1)]

    def _live(self, left: Array) -> NDArray[np.intp]:
        """Places of the terms that any visit can renew: in all others, all states are the same."""
        return np.flatnonzero(np.any(left < self.sizes(self.first).max(axis=0), axis=0))

    def _slack(self) -> Array:
        """(t,) sizes that together make a thousandth of a limit: states that differ by less are one."""
        slope = self.region.steepest
        return np.asarray(_ALIKE / np.maximum(slope * len(slope), 1e-300))

    def _uniform(self, choices: Sequence[Visit], target: int) -> list[Reached]:
        """Schedules of one and the same visit that reach the target: a bound for the search."""
        ways = [self._repeated(visit, target) for visit in choices]
        return [way for way in ways if way.place >= target]

    def _thorough(self) -> Reached:
        """How far the most thorough visits carry, each as late as it can be: no others carry further."""
        most = self.bench.asked.repeats
        visit = Visit(most, most, visit_time(self.bench.asked, most, most))
        return self._repeated(visit, len(self.growth.days) - 1)

    def _repeated(self, visit: Visit, target: int) -> Reached:
        """How far one visit carries, made again and again as late as it can be."""
        state, place = self.first, min(max(self.last_within(self.first, 0), 0), target)
        way: tuple[tuple[int, Visit], ...] = ()
        while place < target:
            after = self.renewed(state, place, visit)
            then = min(self.last_within(after, place), target)
            if then <= place:
                break
            way, state, place = (*way, (place, visit)), after, then
        return Reached(place, way, len(way) * visit.time_s)

    def _choices(self, numbers: Sequence[int]) -> list[Visit]:
        """The visits of which no shorter one leaves as little, to a thousandth of the limit."""
        most = self.bench.asked.repeats
        slope = self.region.steepest
        found: list[Visit] = []
        shares: list[Array] = []
        for visit in visits(self.bench.asked, sorted({min(n, most) for n in numbers})):
            left = self.quantile * self.bench.left(visit.rests, visit.turns)
            share = np.minimum(left, self._ends()) * slope
            others = np.array(shares).reshape(-1, len(share))
            if np.all(np.maximum(others - share, 0.0).sum(axis=1) > _ALIKE):
                found.append(visit)
                shares.append(share)
        return found

    def _ends(self) -> Array:
        """(t,) what every term grows to if nothing is done."""
        return np.asarray(np.maximum(self.sizes(self.first)[-1], 1e-300))

    def _longest(self, choices: Sequence[Visit]) -> int:
        """Steps of the grid that no visit outlasts: everything that a store can renew is new at day 0."""
        best = self.first
        for visit in choices:
            best = self.renewed(best, 0, visit)
        return max(1, self.last_within(best, 0))

    # ---------------------------------------------------------------- answers

    def _names(self, before: State, after: State) -> tuple[str, ...]:
        changed = (after.since != before.since) | (after.size != before.size)
        return tuple(t.name for t, new in zip(self.region.terms, changed, strict=True) if new)

    def following(
        self, done: Sequence[tuple[float, Visit]], later: Sequence[Visit], until: float
    ) -> list[tuple[float, Visit]] | None:
        """Days for later visits, each as late as it can be; None if they do not keep the limits until
        then."""
        state, place, end = self.first, 0, self.place_of(until)
        for i, (day, visit) in enumerate(done):
            place = self.place_of(day)
            since = self.place_of(done[i - 1][0]) if i else 0
            if place > 0 and self.last_within(state, since) < place:
                return None
            state = self.renewed(state, place, visit)
        found = []
        for visit in later:
            then = min(self.last_within(state, place), end)
            if then <= place:
                return None
            found.append((float(self.growth.days[then]), visit))
            state, place = self.renewed(state, then, visit), then
        return found if self.last_within(state, place) >= end else None

    def place_of(self, day: float) -> int:
        """The last day of the grid up to a day."""
        return max(int(np.searchsorted(self.growth.days, day + 1e-6, side="right")) - 1, 0)

    def replayed(self, plan: StorePlan, visits: Sequence[tuple[float, Visit]]) -> StorePlan:
        """A plan with its visits on other days: days as given, loads as on the day of the grid before
        each."""
        way = tuple((self.place_of(day), visit) for day, visit in visits)
        made = self._plan(Reached(self.place_of(plan.kept_until), way, plan.time_s), proved=plan.proved)
        dated = [replace(v, day=day) for v, (day, _) in zip(made.visits, visits, strict=True)]
        return replace(made, visits=tuple(dated))

    def _plan(self, reached: Reached, *, proved: bool) -> StorePlan:
        state, planned = self.first, []
        load, end = self.loads(state), len(self.growth.days) - 1
        for place, visit in reached.way:
            after = self.renewed(state, place, visit)
            now = self.loads(after)
            renewed = self._names(state, after)
            before, behind = float(load[place]), float(now[place])
            planned.append(PlannedVisit(float(self.growth.days[place]), visit, before, behind, renewed))
            load = np.where(np.arange(len(load)) >= place, now, load)
            state = after
        binding, constraint = self._binding(state, min(reached.place + 1, end))
        return StorePlan(
            unit=self.unit,
            days=self.growth.days,
            visits=tuple(planned),
            time_s=reached.cost,
            kept_until=float(self.growth.days[reached.place]),
            whole=bool(load.max() <= 1.0 + ROUNDING),
            load=load,
            without=self.loads(self.first),
            binding=binding,
            constraint=constraint,
            proved=proved,
        )

    def _binding(self, state: State, place: int) -> tuple[tuple[tuple[str, float, bool], ...], int]:
        """The terms that take most on a day: name, share, whether the store can renew it; the constraint."""
        size = self.sizes(state)[place]
        values = [float(self.region.value(c, size, self.reserve)) / c.limit for c in self.region.constraints]
        worst = int(np.argmax(values))
        share = size * self.region.constraints[worst].steepest / self.region.constraints[worst].limit
        best = self.quantile * self.bench.left(self.bench.asked.repeats, self.bench.asked.repeats)
        order = np.argsort(-share)[:5]
        found = tuple((self.region.terms[t].name, float(share[t]), bool(best[t] < size[t])) for t in order)
        return found, worst


def flying_reserve(region: AllowedRegion) -> Reserve:
    """What flights add to sizes that hold estimate and storage themselves."""
    kept = np.ones((len(region.terms), len(PARTS)))
    kept[:, PARTS.index("estimate")] = 0.0
    kept[:, PARTS.index("storage")] = 0.0
    return reserve_of(region, kept)


def grid(period_days: float, start_day: float = 0.0) -> Array:
    """The days on which something may happen."""
    return start_day + np.linspace(0.0, period_days, max(2, min(STEPS, round(period_days)) + 1))


def renewable(
    region: AllowedRegion, bench: StoreBench, growth: Growth, confidence: float
) -> tuple[bool, ...]:
    """For every term: whether the most thorough visit leaves less than there is at the end of the period."""
    most = bench.asked.repeats
    best = float(two_sided(confidence, np.inf)) * bench.left(most, most)
    end = growth.start + growth.between[:, 0, -1]
    return tuple(bool(b < e) and t.term != ALL_AXES for b, e, t in zip(best, end, region.terms, strict=True))
