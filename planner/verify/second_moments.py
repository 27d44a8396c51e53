"""Second moments of the curves over temperature: what they count for in a covariance.

Exact where a formula gives them: for a sigma, for curves that were measured. Where each curve is scaled to
the largest residual, the mean of f fᵀ over many curves: the scale has a long tail (nearly straight curves are
scaled up), so that 20 000 of them are needed to know it to 2 %, and a figure in which it counts to 1 %. Kinks
and cubics, whose tails are the longest, are made of few numbers: over a net of these it is known to 0.5 %.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.protocols import Sensor
from planner.verify.curve_shapes import DRAWN, FEW, POINTS, ROWS, angles, cosines, evenly, position
from planner.verify.curves import (
    LARGEST,
    Curves,
    Family,
    OneUnits,
    SeveralUnits,
    between,
    left_of,
    limited,
    median_of,
    scales,
)
from planner.verify.draws import generator

CURVES = 20_000
OF_COSINES = 6_000  # whose scale hardly varies
BLOCK = 2_000
EVERY = 4  # points of a curve's grid between those at which a moment is kept, of curves without fast waves
Error = tuple[Sensor, str]
_Ends = list[tuple[NDArray[np.intp], Array]]  # places on a grid and their weights


@dataclass(frozen=True)
class Moment:
    """Mean of f fᵀ over an error's curves. grid: (G,) degC; value: (G, G).

    mean: (G,) of f, where it is not zero: it is the same in all terms of all units
    """

    grid: Array
    value: Array
    mean: Array | None = None

    def at(self, degc: Array) -> Array:
        """(k, k) at temperatures (k,), the end segments going on beyond the grid."""
        return self.between(degc, degc)

    def between(self, one: Array, other: Array) -> Array:
        """(k, l) of f at temperatures (k,) with f at others (l,)."""
        return self._mixed(self._ends(one), self._ends(other))

    def through(self, rows: Array, degc: Array) -> Array:
        """(r, r) Σ over terms of rows · E f fᵀ · rowsᵀ; rows (t, r, k) of f at temperatures (k,)."""
        over, kernel = self._on_grid(rows, degc)
        return np.asarray((over @ kernel @ np.swapaxes(over, 1, 2)).sum(axis=0))

    def squares(self, rows: Array, degc: Array) -> Array:
        """(r,) the diagonal of `through` alone."""
        over, kernel = self._on_grid(rows, degc)
        return np.asarray(np.einsum("trg,trg->r", over @ kernel, over))

    def _on_grid(self, rows: Array, degc: Array) -> tuple[Array, Array]:
        """Rows (t, r, g) of f at g points of the grid, and E f fᵀ there; at (k,) where these are fewer.

        Hundreds of moments of a flight that warms by 20 K lie between a few dozen points.
        """
        left, share = between(self.grid, degc)
        used, place = np.unique(np.concatenate([left, left + 1]), return_inverse=True)
        if len(used) >= len(degc):
            return rows, self.at(degc)
        k, hats = np.arange(len(degc)), np.zeros((len(degc), len(used)))
        hats[k, place[: len(k)]], hats[k, place[len(k) :]] = 1.0 - share, share
        return rows @ hats, self.value[np.ix_(used, used)]

    def common(self, rows: Array, degc: Array) -> Array:
        """(r, t) of the mean of f, term by term; rows (t, r, k) of f at temperatures (k,)."""
        assert self.mean is not None  # nobody asks else
        return np.asarray((rows @ sum(weight * self.mean[i] for i, weight in self._ends(degc))).T)

    def of_slopes(self, degc: Array, around: float) -> Array:
        """(k, k) of the mean slopes of f between so many K below and above, per K²."""
        ends = [
            (place, sign / (2.0 * around) * weight)
            for sign in (-1.0, 1.0)
            for place, weight in self._ends(degc + sign * around)
        ]
        return self._mixed(ends, ends)

    def mean_slopes(self, degc: Array, around: float) -> Array:
        """(k,) of the mean of f, between so many K below and above, per K."""
        assert self.mean is not None  # nobody asks else
        below, above = (
            sum(weight * self.mean[i] for i, weight in self._ends(degc + sign * around))
            for sign in (-1.0, 1.0)
        )
        return np.asarray((above - below) / (2.0 * around))

    def _ends(self, degc: Array) -> _Ends:
        left, share = between(self.grid, degc)
        return [(left, 1.0 - share), (left + 1, share)]

    def _mixed(self, one: _Ends, other: _Ends) -> Array:
        parts = [np.outer(a, b) * self.value[np.ix_(i, j)] for i, a in one for j, b in other]
        return np.asarray(sum(parts))


def mean_of(moments: Sequence[Moment]) -> list[Moment]:
    """Moments whose sum is the mean of several: those of one grid are one."""
    found: list[Moment] = []
    for one in moments:
        same = [i for i, m in enumerate(found) if np.array_equal(m.grid, one.grid)]
        if same:
            found[same[0]] = Moment(one.grid, found[same[0]].value + one.value / len(moments))
        else:
            found.append(Moment(one.grid, one.value / len(moments)))
    return found


def moments_of(
    curves: Mapping[Error, Curves], most: int = CURVES, tail: float = np.inf
) -> dict[Error, Moment]:
    """Of the curves of every error. Those of one shape are drawn together: they differ in their scale.

    most: curves to draw, a multiple of BLOCK
    tail: times the median size (rms) of those of a table, beyond which each is taken as that large
    """
    found, drawn = {}, dict[str, dict[Error, Family]]()
    for error, one in curves.items():
        if isinstance(one, Family) and one.figure == "largest":
            group = ".".join(error) if one.shape == "cosines" else one.shape
            drawn.setdefault(group, {})[error] = one
        else:
            found[error] = _exact(one)
    for group, families in drawn.items():
        found |= _sampled(group, families, most, tail)
    return {error: found[error] for error in curves}


def _exact(curves: Curves) -> Moment:
    if isinstance(curves, OneUnits):
        return Moment(curves.grid, np.outer(curves.values, curves.values))
    if isinstance(curves, SeveralUnits):
        mean = curves.values.mean(axis=0)
        return Moment(curves.grid, np.outer(mean, mean) + np.cov(curves.values.T), mean)
    assert isinstance(curves, Family)
    rows = curves.scale * ROWS[curves.shape]() if curves.shape != "cosines" else _modes(curves.amplitude)
    kept = rows - rows.mean(axis=1, keepdims=True)
    return Moment(curves.grid, kept.T @ kept)


def _modes(amplitude: Array) -> Array:
    """(2 MODES, POINTS) rows of cosines of any phase."""
    angle = angles(position())
    rows = np.vstack([np.cos(angle), np.sin(angle)]) * np.tile(amplitude, 2)[:, None]
    return np.asarray(rows / np.sqrt(2.0))


def _sampled(group: str, families: Mapping[Error, Family], most: int, tail: float) -> dict[Error, Moment]:
    first = next(iter(families.values()))
    count = min(OF_COSINES, most) if first.shape == "cosines" else most
    tables = tuple((one.numbers, tuple(one.left.tolist())) for one in families.values())
    values = _of_tables(group, first.shape, tuple(first.amplitude.tolist()), tables, count, tail)
    each = zip(families.items(), values, strict=True)
    every = _every(first.shape)
    return {error: Moment(one.grid[::every], value) for (error, one), value in each}


def _every(shape: str) -> int:
    """Points of the grid between those that are kept; the fastest cosine has 24 in a wave.

    With every fourth of them, straight lines between lose a sixth of its variance.
    """
    return 1 if shape == "cosines" else EVERY


@lru_cache(maxsize=32)  # 32 tables of 0.1 MB an error: another plan of the same unit asks the same again
def _of_tables(
    group: str,
    shape: str,
    amplitude: tuple[float, ...],
    tables: tuple[tuple[tuple[int, ...], tuple[float, ...]], ...],
    count: int,
    tail: float,
) -> tuple[Array, ...]:
    """(G, G) of curves of a shape that leave each of the tables."""
    values = [np.zeros(((POINTS - 1) // _every(shape) + 1,) * 2) for _ in tables]
    every = tuple(sorted({n for numbers, _ in tables for n in numbers}))
    draws = _drawn(group, shape, amplitude, every, count)
    for curve, left in draws if shape == "cosines" else _remembered(group, shape, every, count):
        for value, (numbers, allowed) in zip(values, tables, strict=True):
            most = min(tail, LARGEST) * median_of(shape, amplitude, numbers, allowed)
            scaled = limited(curve * scales(numbers, allowed, left)[:, None], most)
            value += scaled.T @ scaled / count
    for value in values:
        value.flags.writeable = False
    return tuple(values)


@lru_cache(maxsize=3)  # 20 MB each: the shapes that know no table, which another plan's tables scale anew
def _remembered(
    group: str, shape: str, numbers: tuple[int, ...], count: int
) -> tuple[tuple[Array, Mapping[int, Array]], ...]:
    return tuple(_drawn(group, shape, (), numbers, count))


def _drawn(
    group: str, shape: str, amplitude: tuple[float, ...], numbers: tuple[int, ...], count: int
) -> Iterator[tuple[Array, Mapping[int, Array]]]:
    """Block by block, curves (BLOCK, G) before a table scales them, and what each of N points leaves."""
    for curve in _blocks(shape, np.array(amplitude), count, generator(0, 0, "second moment", group)):
        yield curve[:, :: _every(shape)].copy(), {n: left_of(curve, n) for n in numbers}


def _blocks(shape: str, amplitude: Array, count: int, rng: np.random.Generator) -> Iterator[Array]:
    """(BLOCK, POINTS) curves of a shape, their means off, before a table scales them."""
    net = evenly(shape, count, rng) if shape in FEW else np.empty((0, POINTS))
    for block in range(count // BLOCK):
        if shape in FEW:
            curve = net[BLOCK * block : BLOCK * (block + 1)]
        else:
            curve = cosines(BLOCK, rng, amplitude) if shape == "cosines" else DRAWN[shape](BLOCK, rng)
        yield np.asarray(curve - curve.mean(axis=1, keepdims=True))
