"""A smooth curve through points: the cubic spline whose ends know no condition of their own (not-a-knot).

The same curve as scipy.interpolate.CubicSpline, whose import takes 0.5 s; here a few nodes ask for it.
Source: de Boor, A Practical Guide to Splines, 1978, chapter IV.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

LEAST = 4  # nodes: with fewer the third derivative cannot stay across the second and the last but one


@dataclass(frozen=True)
class CubicSpline:
    """Through values (N,) at rising nodes (N,); slopes: (N,) its derivative there."""

    nodes: Array
    values: Array
    slopes: Array

    def __call__(self, x: Array) -> Array:
        """(n,) the curve; beyond the end nodes its end pieces go on."""
        i, t, h, chord = self._at(x)
        above = (self.slopes[i] - chord) * (1.0 - t) - (self.slopes[i + 1] - chord) * t
        return np.asarray(self.values[i] + h * t * (chord + (1.0 - t) * above))

    def derivative(self, x: Array) -> Array:
        """(n,) the curve's slope."""
        i, t, _, chord = self._at(x)
        left, right = self.slopes[i] - chord, self.slopes[i + 1] - chord
        return np.asarray(chord + left * (1.0 - t) * (1.0 - 3.0 * t) - right * t * (2.0 - 3.0 * t))

    def _at(self, x: Array) -> tuple[NDArray[np.int64], Array, Array, Array]:
        """(n,) piece of each x, how far it is through that (0 to 1), its length and its chord's slope."""
        i = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, len(self.nodes) - 2)
        h = self.nodes[i + 1] - self.nodes[i]
        return i, (x - self.nodes[i]) / h, h, (self.values[i + 1] - self.values[i]) / h


def cubic_spline(nodes: Array, values: Array) -> CubicSpline:
    """The spline through values (N,) at rising nodes (N,), N >= 4; two continuous derivatives.

    Raises ValueError with fewer nodes.
    """
    if len(nodes) < LEAST:
        raise ValueError(f"{len(nodes)} nodes are too few for a cubic spline, which needs {LEAST}")
    h = np.diff(nodes)
    chord = np.diff(values) / h
    n = len(nodes)
    A, b = np.zeros((n, n)), np.zeros(n)
    inner = np.arange(1, n - 1)
    A[inner, inner - 1], A[inner, inner], A[inner, inner + 1] = h[1:], 2.0 * (h[:-1] + h[1:]), h[:-1]
    b[inner] = 3.0 * (h[1:] * chord[:-1] + h[:-1] * chord[1:])
    for end, (p, q) in ((0, (0, 1)), (-1, (-1, -2))):
        both = h[p] + h[q]
        A[end, end], A[end, 1 if end == 0 else -2] = h[q], both
        b[end] = ((h[p] + 2.0 * both) * h[q] * chord[p] + h[p] ** 2 * chord[q]) / both
    return CubicSpline(nodes, values, np.asarray(np.linalg.solve(A, b), dtype=float))
