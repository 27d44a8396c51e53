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
    """States on one day that were reached with fewer hours."""

    def __init__(self, slack: Array) -> None:
        self.slack, self.count = slack, 0
        self.sizes, self.since = np.empty((16, len(slack))), np.empty((16, len(slack)), dtype=np.int64)

    def beats(self, state: State) -> bool:
        """Whether one of them has no larger and no older size in any term; if not, the state joins them."""
        n = self.count
        smaller = (self.sizes[:n] <= state.size + self.slack) & (self.since[:n] >= state.since)
        if smaller.all(axis=1).any():
            return True
        if n == len(self.sizes):
            self.sizes, self.since = (np.concatenate([a, np.empty_like(a)]) for a in (self.sizes, self.since))
        self.sizes[n], self.since[n] = state.size, state.since
        self.count = n + 1
        return False
