"""In which order to visit points on a line, starting and ending at one place, with or without waiting."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# The tables of the exact order double with every stop: 18 stops are 38 MB and about a second.
MOST_STOPS = 18
# Orders that differ by less finish at the same time; the simpler one is preferred.
SAME_S = 1e-6


def sweep(points: Sequence[float]) -> tuple[float, ...]:
    """The order that takes least travel from a home through all points and back, exactly, for every home.

    A closed tour crosses every stretch between the lowest and the highest place (home included) at least once
    upwards and once downwards, whatever the two speeds are. Going to the lowest point first and then upwards
    crosses each exactly once each way, so it is optimal; so is the reverse. Among the optimal orders this one
    visits the points in one direction only, which also keeps temperature hysteresis out of the records.
    """
    return tuple(sorted(points))


@dataclass(frozen=True)
class Stops:
    """Work at n stops whose duration may depend on when it begins.

    out (n,), between (n, n), back (n,): seconds from home to the work at a stop, from the end of the work at
    stop j to that at stop k, and home. work: n functions, ready at t -> finished at, for arrays of t; each
    must never decrease (first in, first out).
    """

    out: Array
    between: Array
    back: Array
    work: Sequence[Callable[[Array], Array]]

    def __len__(self) -> int:
        return len(self.out)

    def home_at(self, order: Sequence[int], start: float) -> float:
        """When an order that leaves home at `start` is home again."""
        t = float(start)
        for place, k in enumerate(order):
            travel = self.between[order[place - 1], k] if place else self.out[k]
            t = float(self.work[k](np.asarray(t + travel)))
        return t + float(self.back[order[-1]]) if order else t


def best_order(stops: Stops, start: float) -> tuple[int, ...]:
    """The order that is home first, exactly: dynamic programming over (set of stops done, last one).

    T[S + k, k] = work_k( min_j T[S, j] + between_jk ): of all ways to have done S and to end at j only the
    earliest counts, because no work that begins later ends earlier (FIFO), so waiting before it is allowed
    is worth nothing; and the minimum may be taken before the work for the same reason. n² 2ⁿ⁻¹ sums, n 2ⁿ⁻¹
    evaluations of work (Held and Karp, J. SIAM 10, 1962, with time-dependent stages).
    Of orders that are equally good up to SAME_S the ascending one is taken. Raises ValueError for more than
    MOST_STOPS stops.
    """
    n = len(stops)
    if n > MOST_STOPS:
        raise ValueError(f"{n} stops; exact up to {MOST_STOPS}")
    ascending = tuple(range(n))
    if n < 2:
        return ascending
    finished = _earliest(stops, start)
    order = _traced(stops, finished)
    return ascending if stops.home_at(ascending, start) <= stops.home_at(order, start) + SAME_S else order


def _earliest(stops: Stops, start: float) -> Array:
    """(n, 2ⁿ) earliest finish of every set of stops that ends at each stop."""
    n = len(stops)
    finished = np.full((n, 1 << n), np.inf)
    for k in range(n):
        finished[k, 1 << k] = stops.work[k](np.asarray(start + stops.out[k]))
    sets = np.arange(1 << n)
    count = np.bitwise_count(sets)
    for size in range(1, n):
        layer = sets[count == size]
        done = finished[:, layer]
        for k in range(n):
            without = (layer >> k) & 1 == 0
            ready = (done[:, without] + stops.between[:, k, None]).min(axis=0)
            finished[k, layer[without] | (1 << k)] = stops.work[k](ready)
    return finished


def _traced(stops: Stops, finished: Array) -> tuple[int, ...]:
    """The order behind the earliest return, from its end."""
    left = finished.shape[1] - 1
    last = int(np.argmin(finished[:, left] + stops.back))
    order = [last]
    while left := left ^ (1 << last):
        last = int(np.argmin(finished[:, left] + stops.between[:, last]))
        order.append(last)
    return tuple(reversed(order))


def best_up_and_down(stops: Stops, start: float) -> tuple[int, ...]:
    """The best order that ascends through a part of the stops and descends through the rest, exactly.

    Stops are numbered upwards. All 2ⁿ⁻¹ parts are walked at once; the highest stop is the turning point, so
    the ascending order (all on the way up) and the descending one (all on the way down) are among them.
    Of equally good ones that with most stops on the way up is taken. Raises ValueError as `best_order`.
    """
    n = len(stops)
    if n > MOST_STOPS:
        raise ValueError(f"{n} stops; exact up to {MOST_STOPS}")
    if n < 2:
        return tuple(range(n))
    part = np.arange(1 << (n - 1))
    ready = np.full(len(part), float(start))
    last = np.full(len(part), -1)
    upwards = [(k, (part >> k) & 1 == 1) for k in range(n - 1)]
    for k, rows in [*upwards, (n - 1, part >= 0), *((k, ~rows) for k, rows in reversed(upwards))]:
        travel = np.where(last[rows] < 0, stops.out[k], stops.between[last[rows], k])
        ready[rows] = stops.work[k](ready[rows] + travel)
        last[rows] = k
    home = ready + stops.back[last]
    best = int(part[home <= home.min() + SAME_S].max())
    up = [k for k in range(n - 1) if (best >> k) & 1]
    return (*up, n - 1, *(k for k in reversed(range(n - 1)) if k not in up))
