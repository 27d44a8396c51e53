"""Second moments of the curves over temperature: what they count for in a covariance.

Exact where a formula gives them: for a sigma, for curves that were measured. Where each curve is scaled to
the largest residual, the mean of f fᵀ over many curves: the scale has a long tail (nearly straight curves are
scaled up), so that 20 000 of them are needed to know it to 2 %, and a figure in which it counts to 1 %.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.protocols import Sensor
from planner.verify.curve_shapes import DRAWN, MODES, POINTS, ROWS, cosines, position
from planner.verify.curves import Curves, Family, OneUnits, SeveralUnits, left_of
from planner.verify.draws import generator

CURVES = 20_000
OF_COSINES = 6_000  # whose scale hardly varies
BLOCK = 2_000
EVERY = 4  # points of a curve's grid between those at which a moment is kept
Error = tuple[Sensor, str]
_Ends = list[tuple[NDArray[np.intp], Array]]  # places on a grid and their weights


@dataclass(frozen=True)
class Moment:
    """Mean of f fᵀ over an error's curves. grid: (G,) degC; value: (G, G)."""

    grid: Array
    value: Array

    def at(self, degc: Array) -> Array:
        """(k, k) at temperatures (k,), the end segments going on beyond the grid."""
        return self.between(degc, degc)

    def between(self, one: Array, other: Array) -> Array:
        """(k, l) of f at temperatures (k,) with f at others (l,)."""
        return self._mixed(self._ends(one), self._ends(other))

    def of_slopes(self, degc: Array) -> Array:
        """(k, k) of the slopes of f, per K²."""
        left = self._left(degc)
        each = 1.0 / (self.grid[left + 1] - self.grid[left])
        ends = [(left, -each), (left + 1, each)]
        return self._mixed(ends, ends)

    def _left(self, degc: Array) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(self.grid, degc, side="right") - 1, 0, len(self.grid) - 2)

    def _ends(self, degc: Array) -> _Ends:
        left = self._left(degc)
        share = (degc - self.grid[left]) / (self.grid[left + 1] - self.grid[left])
        return [(left, 1.0 - share), (left + 1, share)]

    def _mixed(self, one: _Ends, other: _Ends) -> Array:
        parts = [np.outer(a, b) * self.value[np.ix_(i, j)] for i, a in one for j, b in other]
        return np.asarray(sum(parts))


def moments_of(curves: Mapping[Error, Curves], most: int = CURVES) -> dict[Error, Moment]:
    """Of the curves of every error. Those of one shape are drawn together: they differ in their scale.

    most: curves to draw, a multiple of BLOCK
    """
    found, drawn = {}, dict[str, dict[Error, Family]]()
    for error, one in curves.items():
        if isinstance(one, Family) and one.figure == "largest":
            group = ".".join(error) if one.shape == "cosines" else one.shape
            drawn.setdefault(group, {})[error] = one
        else:
            found[error] = _exact(one)
    for group, families in drawn.items():
        found |= _sampled(group, families, most)
    return {error: found[error] for error in curves}


def _exact(curves: Curves) -> Moment:
    if isinstance(curves, OneUnits):
        return Moment(curves.grid, np.outer(curves.values, curves.values))
    if isinstance(curves, SeveralUnits):
        mean = curves.values.mean(axis=0)
        return Moment(curves.grid, np.outer(mean, mean) + np.cov(curves.values.T))
    assert isinstance(curves, Family)
    rows = curves.scale * ROWS[curves.shape]() if curves.shape != "cosines" else _modes(curves.amplitude)
    kept = (rows - rows.mean(axis=1, keepdims=True))[:, ::EVERY]
    return Moment(curves.grid[::EVERY], kept.T @ kept)


def _modes(amplitude: Array) -> Array:
    """(2 MODES, POINTS) rows of cosines of any phase."""
    angle = np.pi * np.arange(1, MODES + 1)[:, None] * position()
    rows = np.vstack([np.cos(angle), np.sin(angle)]) * np.tile(amplitude, 2)[:, None]
    return np.asarray(rows / np.sqrt(2.0))


def _sampled(group: str, families: Mapping[Error, Family], most: int) -> dict[Error, Moment]:
    first = next(iter(families.values()))
    count = min(OF_COSINES, most) if first.shape == "cosines" else most
    value = {error: np.zeros((POINTS // EVERY + 1,) * 2) for error in families}
    numbers = sorted({n for one in families.values() for n in one.numbers})
    for curve in _blocks(first, count, generator(0, 0, "second moment", group)):
        left = {n: left_of(curve, n) for n in numbers}
        for error, one in families.items():
            scaled = curve[:, ::EVERY] * one.scales(left)[:, None]
            value[error] += scaled.T @ scaled / count
    return {error: Moment(one.grid[::EVERY], value[error]) for error, one in families.items()}


def _blocks(one: Family, count: int, rng: np.random.Generator) -> Iterator[Array]:
    """(BLOCK, POINTS) curves of a shape, their means off, before a table scales them."""
    for _ in range(count // BLOCK):
        is_cosines = one.shape == "cosines"
        curve = cosines(BLOCK, rng, one.amplitude) if is_cosines else DRAWN[one.shape](BLOCK, rng)
        yield np.asarray(curve - curve.mean(axis=1, keepdims=True))
