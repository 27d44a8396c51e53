"""When a batch that comes to a bench leaves it again, and in which order it visits the temperatures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Literal

import numpy as np

from planner.plan.bench_work import BenchWork, Block, ramp_time, stop_passage
from planner.solvers.calendar import Calendar, Passage, constant
from planner.solvers.ordering import MOST_STOPS, Stops, best_order, best_up_and_down
from planner.spec.attendance import calendar_of, start_of
from planner.spec.model import Spec

Order = Literal["free", "up", "down", "up_and_down"]


class BenchTiming:
    """The work on one bench against the laboratory's clock; times in seconds of the campaign.

    All of it never decreases with its start (planner.solvers.calendar), so to leave the bench earliest is
    also best for whatever comes later.
    """

    def __init__(self, spec: Spec, work: BenchWork) -> None:
        self.work, self.count = work, spec.benches[work.bench].count
        self.hours, self._start, self._order = calendar_of(spec), start_of(spec), spec.plan.order
        self._before = _passage(self.hours, work.before)
        self._after = _passage(self.hours, work.after)
        self._stops = _stops(spec, self.hours, work)
        self._known: dict[float, tuple[int, ...]] = {}

    @property
    def waits(self) -> bool:
        """Whether the order of the temperatures decides about waiting."""
        return not all(isinstance(p, Passage) and p.is_constant for p in self._stops.work)

    @property
    def is_exact(self) -> bool:
        """Whether the order is the best one that the spec allows."""
        return self._order in ("up", "down") or not self.waits or len(self._stops) <= MOST_STOPS

    def order(self, ready: float) -> tuple[int, ...]:
        """Indices of the stops in the best order that the spec allows, for a batch that comes at `ready`."""
        if not self.waits:
            return _monotone(len(self._stops), self._order)
        start = float(self._before(self._start + ready))
        key = round(start % self.hours.period, 6)
        if key not in self._known:
            self._known[key] = best_of(self._stops, self._order, start)
        return self._known[key]

    def end(self, ready: float) -> float:
        """When a batch that is there at `ready` has been taken off."""
        start = float(self._before(self._start + ready))
        return float(self._after(self._stops.home_at(self.order(ready), start))) - self._start

    def begin(self, block: Block, ready: float) -> float:
        """When a block that could begin at `ready` begins."""
        if self.hours.always or not block.attended:
            return ready
        passage = self.hours.passage(block.attended, block.seconds)
        start = float(passage(self._start + ready)) - block.seconds - self._start
        return ready if start - ready < 1e-6 else round(start, 6)  # rounding of sums is no waiting


def best_of(stops: Stops, order: Order, start: float) -> tuple[int, ...]:
    """The best order of stops (numbered upwards) that a rule allows.

    Beyond MOST_STOPS the better one of the two monotone orders.
    """
    if order in ("up", "down"):
        return _monotone(len(stops), order)
    if len(stops) <= MOST_STOPS:
        return (best_order if order == "free" else best_up_and_down)(stops, start)
    both = [_monotone(len(stops), one) for one in ("up", "down")]
    return min(both, key=lambda candidate: stops.home_at(candidate, start))


def _monotone(count: int, order: str) -> tuple[int, ...]:
    """Without waiting every monotone order is as short as any, for every home (planner.solvers.ordering)."""
    return tuple(reversed(range(count))) if order == "down" else tuple(range(count))


def _passage(hours: Calendar, blocks: Sequence[Block]) -> Passage:
    """Blocks one after the other; equal ones (the repeats of a test) are found once."""
    found: dict[tuple[object, float], Passage] = {}
    for b in blocks:
        key = (b.attended, b.seconds)
        if key not in found:
            found[key] = hours.passage(b.attended, b.seconds)
    nothing = constant(0.0, hours.period)
    return reduce(Passage.then, (found[b.attended, b.seconds] for b in blocks), nothing)


def _stops(spec: Spec, hours: Calendar, work: BenchWork) -> Stops:
    chamber, room = spec.benches[work.bench].chamber, spec.plan.temperatures.room
    if chamber is None:
        return Stops(np.zeros(0), np.zeros((0, 0)), np.zeros(0), ())
    places = [stop.temperature_degc for stop in work.stops]
    between = [[ramp_time(chamber, a, b) + chamber.soak for b in places] for a in places]
    return Stops(
        np.array([ramp_time(chamber, room, t) + chamber.soak for t in places]),
        np.array(between),
        np.array([ramp_time(chamber, t, room) for t in places]),
        tuple(stop_passage(spec, hours, stop) for stop in work.stops),
    )
