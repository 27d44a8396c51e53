"""Curves over one range, at POINTS even places x from 0 to 1; tables of straight lines on them.

Curves are rows, (…, G); a shape is drawn as (count, POINTS). Those by which campaigns are judged are numbers
of single precision, half the work: a residual of a fiftieth of its curve has five digits.
"""

from __future__ import annotations

from functools import cache
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

Single = NDArray[np.float32]
Real = TypeVar("Real", NDArray[np.float64], NDArray[np.float32])
POINTS = 481
BLOCK = 250


class Shape(Protocol):
    """What a random curve over x looks like, before its mean is taken off and a table sets its size."""

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, POINTS) independent curves."""

    def evenly(self, count: int, rng: np.random.Generator) -> Single:
        """(count, POINTS) of the same law, evenly in it where it has few dimensions; else independent."""
        return self.draws(count, rng).astype(np.float32)

    def rows(self) -> Array:
        """(r, POINTS) R whose RᵀR is the second moment E f fᵀ of the shape."""


def lattice(count: int, rng: np.random.Generator) -> Array:
    """(2, count) points in the unit square, each of them uniform, all of them even, in random order.

    The lattice of the golden ratio, shifted at random (Niederreiter, Random Number Generation and Quasi-Monte
    Carlo Methods, 1992, 5.1): the quantile of what a table leaves of a kink scatters a fourth as much as over
    as many draws, of a cubic a thirtieth.
    """
    i, golden = rng.permutation(count), 0.5 * (np.sqrt(5.0) - 1.0)
    return np.asarray((np.stack([i / count, i * golden]) + rng.uniform(size=(2, 1))) % 1.0)


def places() -> Array:
    """(POINTS,) x."""
    return np.linspace(0.0, 1.0, POINTS)


def even_table(curve: Real, points: int) -> Real:
    """(…, G) what a table of `points` even nodes gives; one point gives the middle value."""
    nodes, x, hats = _straight_lines(points, np.shape(curve)[-1])
    return np.asarray(along(nodes, x, curve) @ hats.astype(curve.dtype), dtype=curve.dtype)


@cache
def _straight_lines(points: int, over: int) -> tuple[Array, Array, Array]:
    """(N,) even nodes, (G,) places, (N, G) hats."""
    nodes = np.linspace(0.0, 1.0, points) if points > 1 else np.array([0.5])
    x = np.linspace(0.0, 1.0, over)
    return nodes, x, np.array([np.interp(x, nodes, one) for one in np.eye(points)])


def largest_left(curves: Real, points: int) -> Real:
    """(…) the largest residual of `even_table`."""
    if np.ndim(curves) == 2 and len(curves) > BLOCK:  # what stays in the processor's cache is done in a third
        return np.concatenate(
            [largest_left(some, points) for some in np.array_split(curves, len(curves) // BLOCK)]
        )
    left = even_table(curves, points)
    np.subtract(curves, left, out=left)
    return np.asarray(np.maximum(left.max(axis=-1), -left.min(axis=-1)))


def centred(curves: Real) -> Real:
    """(…, G) less the mean over the grid."""
    return np.asarray(curves - curves.mean(axis=-1, keepdims=True))


def along(at: Array, grid: Array, curve: Real) -> Real:
    """(…, n) curves (…, G) at places (n,) of their grid (G,) ascending; the end segments go on beyond it."""
    left = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, len(grid) - 2)
    share = ((at - grid[left]) / (grid[left + 1] - grid[left])).astype(curve.dtype)
    return np.asarray(curve[..., left] * (1.0 - share) + curve[..., left + 1] * share)
