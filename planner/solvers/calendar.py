"""Working hours, and what waiting for them does to a sequence of work.

A *passage* says when work that is ready at t is finished. Work that needs people waits until it fits into a
shift, so a passage has the form

    F(t) = max(t + offset_i, floor_i)   for upper_{i−1} < t <= upper_i,      F(t + period) = F(t) + period

It never decreases: whoever is ready later is never finished earlier (first in, first out), so waiting on
purpose never helps, and the earliest finish of a part is the best start of the rest. Two passages after one
another are a passage of the same form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Span = tuple[float, float]

# Sums of ten thousand durations round by less; work that ends with the shift must not miss it by rounding.
SLACK = 1e-6
# Pieces shorter than this come from rounding only.
_SHORTEST = 1e-7


@dataclass(frozen=True)
class Passage:
    """When work that is ready at t is finished; upper ascending in [0, period), all arrays (n,), seconds."""

    period: float
    upper: Array
    offset: Array
    floor: Array

    def __call__(self, t: Array | float) -> Array:
        """Finish of the work, for any shape of t."""
        t = np.asarray(t, dtype=np.float64)
        if self.is_constant:
            return np.asarray(t + self.offset[0])
        piece, base = self._piece(t)
        return np.asarray(np.maximum(t + self.offset[piece], base + self.floor[piece]))

    @property
    def is_constant(self) -> bool:
        """Whether it takes equally long at every time of the week."""
        return len(self.upper) == 1 and bool(np.isneginf(self.floor[0]))

    def then(self, other: Passage) -> Passage:
        """This work and the other right after it."""
        if self.is_constant and other.is_constant:
            return constant(float(self.offset[0] + other.offset[0]), self.period)
        upper = self._breaks(other)
        before = np.concatenate([[upper[-1] - self.period], upper[:-1]])
        middle = (before + upper) / 2  # a break itself may round to either side of it
        i, base = self._piece(middle)
        j, other_base = other._piece(self(middle))
        offset = self.offset[i] + other.offset[j]
        floor = np.maximum(base + self.floor[i] + other.offset[j], other_base + other.floor[j])
        return _merged(Passage(self.period, upper, offset, floor))

    def times(self, count: int) -> Passage:
        """This work `count` times in a row."""
        result, square = constant(0.0, self.period), self
        while count:
            if count & 1:
                result = result.then(square)
            count >>= 1
            if count:
                square = square.then(square)
        return result

    def earlier(self, seconds: float) -> Passage:
        """The same work without its last, unattended, `seconds`."""
        return Passage(self.period, self.upper, self.offset - seconds, self.floor - seconds)

    def _piece(self, t: Array) -> tuple[NDArray[np.intp], Array]:
        """Index of the piece of every t, and the start of the period that the piece's floor counts from."""
        within = np.mod(t, self.period)
        piece = np.searchsorted(self.upper, within, side="left")
        beyond = piece == len(self.upper)
        return np.where(beyond, 0, piece), t - within + beyond * self.period

    def _breaks(self, other: Passage) -> Array:
        """Where the form of `self then other` changes: own breaks, and where own finish passes another's."""
        before = np.concatenate([[self.upper[-1] - self.period], self.upper[:-1]])[:, None]
        offset, own = self.offset[:, None], self.upper[:, None]
        turns = np.floor((before + offset - other.upper) / self.period) + 1
        passed = other.upper + turns * self.period - offset
        kept = passed[(passed < own) & (passed + offset >= self.floor[:, None])]
        found = np.sort(np.concatenate([self.upper, np.mod(kept, self.period)]))
        return found[np.r_[np.diff(found) > _SHORTEST, True]]


def constant(seconds: float, period: float) -> Passage:
    """Work that needs nobody and takes `seconds`."""
    return Passage(period, np.zeros(1), np.full(1, float(seconds)), np.full(1, -np.inf))


def _merged(p: Passage) -> Passage:
    """Without the breaks at which nothing changes."""
    if len(p.upper) == 1:
        return p
    waits = p.upper + p.offset <= p.floor + _SHORTEST
    same_floor = np.abs(p.floor - np.roll(p.floor, -1)) < _SHORTEST
    same_offset = np.abs(p.offset - np.roll(p.offset, -1)) < _SHORTEST
    redundant = same_floor & (waits | same_offset)
    redundant[-1] = False  # the next one counts from another period
    keep = ~redundant
    return Passage(p.period, p.upper[keep], p.offset[keep], p.floor[keep])


@dataclass(frozen=True)
class Calendar:
    """Working hours that repeat: disjoint windows (opens, closes) with 0 <= opens < period.

    A window may close in the next period. No windows: nobody ever works. `always`: somebody always does.
    """

    period: float
    windows: tuple[Span, ...]
    always: bool = False

    @property
    def longest(self) -> float:
        """Seconds of the longest shift."""
        return np.inf if self.always else max((b - a for a, b in self.windows), default=0.0)

    def passage(self, attended: Sequence[Span], seconds: float) -> Passage:
        """Work of `seconds` that is not interrupted, with people present during the `attended` spans of it.

        attended: (start, end) from the start of the work. Raises ValueError when it fits into no week.
        """
        if self.always or not attended:
            return constant(seconds, self.period)
        starts = self._starts(attended)
        if not starts:
            raise ValueError("this work fits into no shift")
        by_end = sorted(((b % self.period), b - a) for a, b in starts)
        last = np.array([end for end, _ in by_end])
        first = last - np.array([length for _, length in by_end])
        return Passage(self.period, last, np.full(len(last), float(seconds)), first + seconds)

    def _starts(self, attended: Sequence[Span]) -> list[Span]:
        """Times at which the work may start: disjoint, 0 <= opens < period."""
        found: list[Span] | None = None
        for start, end in dict.fromkeys(attended):
            fits = [
                _turned(a - start, b - end + SLACK, self.period)
                for a, b in self.windows
                if b - a + SLACK >= end - start
            ]
            found = fits if found is None else _common(found, fits, self.period)
        return found or []


def calendar(period: float, windows: Sequence[Span]) -> Calendar:
    """Working hours from windows (opens, closes) that may overlap, touch, or go on into the next period."""
    merged: list[Span] = []
    for a, b in sorted(_turned(a, b, period) for a, b in windows):
        if merged and a <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(b, merged[-1][1]))
        else:
            merged.append((a, b))
    while len(merged) > 1 and merged[-1][1] - period >= merged[0][0]:  # the last one goes on into the first
        first = merged.pop(0)
        merged[-1] = (merged[-1][0], max(merged[-1][1], first[1] + period))
    if any(b - a >= period for a, b in merged):
        return Calendar(period, (), always=True)
    return Calendar(period, tuple(merged))


def _turned(a: float, b: float, period: float) -> Span:
    start = a % period
    return start, start + (b - a)


def _common(ours: Sequence[Span], theirs: Sequence[Span], period: float) -> list[Span]:
    """Times in both, as intervals on the circle."""
    found = []
    for (a, b), (c, d), turn in product(ours, theirs, (-period, 0.0, period)):
        low, high = max(a, c + turn), min(b, d + turn)
        if low <= high:
            found.append(_turned(low, high, period))
    return sorted(found)
