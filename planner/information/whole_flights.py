"""The largest error of whole flights that were drawn, and within which length a share of them lies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

AT_ONCE = 4_000_000  # numbers
ROUNDING = 1e-4


@dataclass(frozen=True)
class Flights:
    """Flights at places x (s, k, n) along axes (I c, k), with the same (s, I c) in all of a temperature."""

    axes: NDArray[np.float32]
    x: NDArray[np.float32]
    shift: NDArray[np.float32]
    c: int

    def beyond(self, least: float) -> NDArray[np.float32]:
        """(s, n) the largest length of every flight; of some that are shorter than `least` zero."""
        far = self._reach() >= least
        found = np.zeros(far.shape, dtype=np.float32)
        at_once = max(AT_ONCE // len(self.axes), 1)
        for one, own, shift, those in zip(found, self.x, self.shift, far, strict=True):
            places = np.flatnonzero(those)
            for begin in range(0, len(places), at_once):
                which = places[begin : begin + at_once]
                one[which] = _longest(self.axes @ own[:, which] + shift[:, None], self.c)
        return found

    def _reach(self) -> NDArray[np.float32]:
        """(s, n) what the largest length is at most."""
        each = self.axes.reshape(-1, self.c, self.axes.shape[1])
        shifts = np.linalg.norm(self.shift.reshape(len(self.x), -1, self.c), axis=2).max(axis=1)
        most = np.linalg.norm(each, ord=2, axis=(1, 2)).max() * (1.0 + ROUNDING)
        return np.asarray(np.sqrt(np.einsum("skn,skn->sn", self.x, self.x)) * most + shifts[:, None])


def _longest(vectors: NDArray[np.float32], c: int) -> NDArray[np.float32]:
    """(n,) the largest length over the instants of vectors (I c, n)."""
    if c == 1:
        return np.asarray(np.maximum(vectors.max(axis=0), -vectors.min(axis=0)))
    np.square(vectors, out=vectors)
    squares = vectors[::c]
    for i in range(1, c):
        squares += vectors[i::c]
    return np.asarray(np.sqrt(squares.max(axis=0)))


def length_of_share(lengths: Array | NDArray[np.float32], share: float, weights: Array | None) -> float:
    """Within which a share of drawn lengths (s, n) lies; weights (s,) of temperatures, None: of the worst."""
    if weights is None:
        return float(np.quantile(lengths, share, axis=1).max())
    order = _ascending(lengths)
    each = np.repeat(weights / lengths.shape[1], lengths.shape[1])[order]
    place = int(np.searchsorted(np.cumsum(each), share))
    return float(lengths.ravel()[order][min(place, len(order) - 1)])


def _ascending(lengths: Array | NDArray[np.float32]) -> NDArray[np.intp]:
    """(n,) places of lengths, the shortest first.

    The binary digits of float32 order as they do, where none is negative: with the place behind each they are
    sorted in half the time that it takes to sort places.
    """
    if lengths.dtype != np.float32:
        return np.argsort(lengths, axis=None)
    digits = np.abs(lengths).view(np.uint32).ravel().astype(np.uint64)
    ordered = np.sort(digits << np.uint64(32) | np.arange(lengths.size, dtype=np.uint64))
    return (ordered & np.uint64(0xFFFF_FFFF)).astype(np.intp)
