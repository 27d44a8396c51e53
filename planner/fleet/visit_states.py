"""Where the search for the cheapest visits stands: sizes of the terms, and states that no other beats."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fleet.store import Visit
from planner.nouns.array import Array


@dataclass(frozen=True)
class State:
    """Sizes (t,) at the last renewal of every term, and when that was (t,): row of `Growth.between`."""

    size: Array
    since: NDArray[np.int64]


@dataclass(frozen=True)
class Reached:
    """How far a way of (place, visit) goes, and what it costs."""

    place: int
    way: tuple[tuple[int, Visit], ...]
    cost: float


class Known:
    """States on one day that were reached with fewer hours; slack: (t,) of the terms that differ."""

    def __init__(self, slack: Array) -> None:
        self.slack, self.count = slack, 0
        self.sizes, self.since = np.empty((16, len(slack))), np.empty((16, len(slack)), dtype=np.int64)

    def beats(self, state: State, live: NDArray[np.intp]) -> bool:
        """Whether one of them has no larger and no older size in any live term; if not, the state joins
        them."""
        n, size, since = self.count, state.size[live], state.since[live]
        smaller = (self.sizes[:n] <= size + self.slack) & (self.since[:n] >= since)
        if smaller.all(axis=1).any():
            return True
        if n == len(self.sizes):
            self.sizes, self.since = (np.concatenate([a, np.empty_like(a)]) for a in (self.sizes, self.since))
        self.sizes[n], self.since[n] = size, since
        self.count = n + 1
        return False
