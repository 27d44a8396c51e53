"""Campaigns one step away: a repeat or a visit less, elsewhere, exchanged; a temperature moved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.information.distinct import distinct
from planner.information.offers import Offer, Offers
from planner.nouns.array import Array

SHIFTS = (-3, -2, -1, 1, 2, 3)  # steps of the grid by which a temperature is moved


@dataclass(frozen=True)
class Neighbours:
    """Moves over the counts (g,) of an offer that keep what hands fixed and the bounds of repeats."""

    offers: Offers

    def of(self, n: Array) -> NDArray[np.float64]:
        """(B, g) distinct campaigns one step from n (g,)."""
        return _others([n, *self._alike(n), *self._split(n)], n)

    def whatever_they_cost(self, n: Array) -> NDArray[np.float64]:
        """(B, g) campaigns one step from n (g,), with more records or fewer, for who asks what they tell.

        Nothing is split, half of all moves: a visit more tells more where it is made as often as any other.
        """
        return np.concatenate([_others([n, *self._alike(n)], n), self.more(n), self.most(n)])

    def fewer(self, n: Array) -> NDArray[np.float64]:
        """(B, g) distinct campaigns with something left out."""
        return _others([n, *self._fewer(n)], n)

    def more(self, n: Array) -> NDArray[np.float64]:
        """(B, g) campaigns with more records: a repeat more somewhere, or a visit more."""
        found = []
        for offer in self._free:
            for k in offer.places:
                step = 1 if n[k] > 0 else offer.least
                if n[k] + step <= offer.most:
                    found.append(altered(n, (k, n[k] + step)))
            used = [k for k in offer.places if 0 < n[k] < offer.most]
            if len(used) > 1:
                found.append(altered(n, *((k, n[k] + 1) for k in used)))
        return np.array(found).reshape(-1, len(n))

    def most(self, n: Array) -> NDArray[np.float64]:
        """(B, g) campaigns with one visit more, made as often as any other of its test."""
        found = []
        for offer in self._movable:
            repeats = max(n[offer.places].max(), offer.least)
            found += [altered(n, (k, repeats)) for k in offer.places if n[k] == 0]
        return np.array(found).reshape(-1, len(n))

    def shaken(self, n: Array, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """(B, g) campaigns whose temperatures are all moved at once, by a step of the grid or not."""
        found, together = [], [self._at(n, t) for t in self._temperatures(n)]
        for _ in range(count):
            moved = n
            for kinds in together:
                shift = int(rng.integers(-1, 2))
                for k in kinds if shift else ():
                    to = self._shifted(k, shift)
                    moved = moved if to is None else _onto(moved, k, to)
            found.append(moved)
        every = distinct(found)
        return np.asarray(every[(every != n).any(axis=1)])

    # ------------------------------------------------------------ what may be moved

    @cached_property
    def _free(self) -> list[Offer]:
        return [o for o in self.offers.tests if o.fixed is None]

    @cached_property
    def _movable(self) -> list[Offer]:
        return [o for o in self._free if not o.everywhere]

    @cached_property
    def _degc(self) -> list[float]:
        return [float(t) for t in self.offers.degc]

    @cached_property
    def _on_grid(self) -> dict[int, tuple[list[int], int]]:
        """Kind that may be moved -> the kinds of its test, and where it stands among them."""
        every = ([int(k) for k in offer.places] for offer in self._movable)
        return {k: (places, i) for places in every for i, k in enumerate(places)}

    def _alike(self, n: Array) -> Iterator[Array]:
        for moves in (self._fewer, self._moved, self._joined, self._exchanged, self._spread):
            yield from moves(n)

    def _used(self, n: Array, offer: Offer) -> list[int]:
        return [int(k) for k in offer.places[n[offer.places] > 0]]

    def _fewer(self, n: Array) -> Iterator[Array]:
        for offer in self._free:
            used = self._used(n, offer)
            for k in used:
                if n[k] > offer.least:
                    yield altered(n, (k, n[k] - 1))
                if not offer.everywhere:
                    yield altered(n, (k, 0))
            if used and all(n[k] > offer.least for k in used):
                yield altered(n, *((k, n[k] - 1) for k in used))
            if used:
                yield altered(n, *((k, offer.least) for k in used))
                yield altered(n, *((k, 0) for k in used))
        for t in self._temperatures(n):
            yield altered(n, *((k, 0) for k in self._at(n, t)))

    def _moved(self, n: Array) -> Iterator[Array]:
        """Every visit for itself, and every temperature with all that is done there."""
        for offer in self._movable:
            for k in self._used(n, offer):
                for to in self._beside(k):
                    yield _onto(n, k, to)
        for t in self._temperatures(n):
            together = self._at(n, t)
            for shift in SHIFTS:
                moved = n
                for k in together:
                    place = self._shifted(k, shift)
                    moved = moved if place is None else _onto(moved, k, place)
                yield moved

    def _joined(self, n: Array) -> Iterator[Array]:
        """A visit moved to another temperature that is visited already."""
        visited = set(self._temperatures(n))
        for offer in self._movable:
            for k in self._used(n, offer):
                for to in self._on_grid[k][0]:
                    if to != k and self._degc[to] in visited:
                        yield _onto(n, k, to)

    def _exchanged(self, n: Array) -> Iterator[Array]:
        """One repeat less here and one more there; a visit less here and a repeat more there."""
        used = [(o, k) for o in self._free for k in self._used(n, o)]
        for offer, k in used:
            less = n[k] - 1 if n[k] > offer.least else 0
            if less == 0 and offer.everywhere:
                continue
            for other, j in used:
                if j != k and n[j] < other.most:
                    yield altered(n, (k, less), (j, n[j] + 1))

    def _spread(self, n: Array) -> Iterator[Array]:
        """A temperature less, and those next to it moved towards where it was."""
        visited = sorted(self._temperatures(n))
        for i, t in enumerate(visited):
            without = altered(n, *((k, 0) for k in self._at(n, t)))
            for near, towards in ((i - 1, 1), (i + 1, -1)):
                if 0 <= near < len(visited):
                    for by in (1, 2, 3):
                        moved = without
                        for k in self._at(n, visited[near]):
                            to = self._shifted(k, towards * by)
                            moved = moved if to is None else _onto(moved, k, to)
                        yield moved

    def _split(self, n: Array) -> Iterator[Array]:
        """As many repeats as a visit has at least made at a temperature that its test does not visit yet.

        Where soaks cost nothing (power-on hours, tests in the room) they tell more of the curves there.
        """
        for offer in self._movable:
            for k in self._used(n, offer):
                if n[k] >= 2 * offer.least:
                    for to in self._on_grid[k][0]:
                        if n[to] == 0:
                            yield altered(n, (k, n[k] - offer.least), (to, offer.least))

    # ------------------------------------------------------------ the grid

    def _temperatures(self, n: Array) -> list[float]:
        """Chamber temperatures that are visited by tests that may be moved."""
        return sorted({self._degc[k] for o in self._movable for k in self._used(n, o)})

    def _at(self, n: Array, t: float) -> list[int]:
        return [k for o in self._movable for k in self._used(n, o) if self._degc[k] == t]

    def _beside(self, k: int) -> Iterator[int]:
        return (to for shift in SHIFTS if (to := self._shifted(k, shift)) is not None)

    def _shifted(self, k: int, shift: int) -> int | None:
        if k not in self._on_grid:
            return None
        places, i = self._on_grid[k]
        return places[i + shift] if 0 <= i + shift < len(places) else None


def _others(found: Sequence[Array], n: Array) -> NDArray[np.float64]:
    """(B, g) those of the campaigns that are not n, and something, each once."""
    every = distinct(found)
    return np.asarray(every[(every != n).any(axis=1) & (every > 0).any(axis=1)])


def altered(n: Array, *changes: tuple[int, float]) -> Array:
    """The campaign n (g,) with other counts at some places."""
    found = n.copy()
    for k, value in changes:
        found[k] = value
    return found


def _onto(n: Array, k: int, to: int) -> Array:
    """The visit at k made at `to` instead; where there is one already the larger stays."""
    return altered(n, (to, max(n[k], n[to])), (k, 0)) if k != to else n
