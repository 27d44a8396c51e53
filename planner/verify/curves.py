"""Random curves over temperature that leave what the spec's table says, by verify's own arithmetic.

The table does not say what the curves look like: `curve_shapes` has four families that may leave the same.
Of every curve the mean over the range is taken off. `figure: largest`: each curve is scaled until its largest
residual meets the table at one N and exceeds it at none, but is no larger than LARGEST times the median of
its family: nearly straight ones have no second moment where the table says nothing of slopes. `figure:
sigma`: the mean square itself is the table's, of cosines at every N; the others have one scale for the
family, the largest at which they exceed it at no N. The amplitudes of the cosines are such that N evenly
spread points with straight lines leave, over phases and temperatures, mean squares that fall with N as the
table does, 2.2 being peak over rms of what is left.

A curve measured on one unit is one sample: units draw from the families that leave what N points leave of it,
or are that curve, plus or minus (`measured`). Of several units' curves mean and covariance are taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.verify.curve_shapes import DRAWN, MODES, POINTS, ROWS, angles, cosines

Figure = Literal["largest", "sigma"]
MOST_POINTS = 10  # of the table that one measured curve is turned into
ROUNDING = 1e-9  # of the largest value: what is less is left by arithmetic
LARGEST = 10.0  # times the median size (rms) of a family, beyond which no curve is scaled
MEDIAN_OF = 2_000  # curves: known to 1.5 %
_PEAK = 2.2
_FINE = 241  # points at which a mode's residual is averaged


class Curves(Protocol):
    """Curves over temperature to draw from. grid: (G,) degC."""

    @property
    def grid(self) -> Array:
        """(G,) degC."""

    def drawn(self, count: int, rng: np.random.Generator) -> Array:
        """(count, G) curves, SI."""


@dataclass(frozen=True)
class Family:
    """Curves of one shape that leave a table. grid: (POINTS,) degC; numbers, left: the table, SI.

    amplitude: (MODES,) of cosines; scale: of the other shapes, for a sigma
    """

    shape: str
    grid: Array
    numbers: tuple[int, ...]
    left: Array
    figure: Figure
    amplitude: Array
    scale: float = 1.0

    def drawn(self, count: int, rng: np.random.Generator) -> Array:
        """(count, POINTS) curves, SI."""
        if self.shape == "cosines":
            curve = cosines(count, rng, self.amplitude)
        else:
            curve = self.scale * DRAWN[self.shape](count, rng)
        curve -= curve.mean(axis=1, keepdims=True)
        if self.figure == "sigma":
            return np.asarray(curve)
        left = {n: left_of(curve, n) for n in self.numbers}
        curve *= scales(self.numbers, self.left, left)[:, None]
        return limited(curve, LARGEST * self.median)

    @property
    def median(self) -> float:
        """Size (rms) in the middle of those that are scaled to a largest residual."""
        return median_of(self.shape, tuple(self.amplitude.tolist()), self.numbers, tuple(self.left.tolist()))


@lru_cache(maxsize=256)
def median_of(
    shape: str, amplitude: tuple[float, ...], numbers: tuple[int, ...], table: tuple[float, ...]
) -> float:
    """Size in the middle of curves of a shape that leave a table."""
    rng = np.random.default_rng(MEDIAN_OF)
    if shape == "cosines":
        curve = cosines(MEDIAN_OF, rng, np.array(amplitude))
    else:
        curve = DRAWN[shape](MEDIAN_OF, rng)
    curve -= curve.mean(axis=1, keepdims=True)
    scale = scales(numbers, table, {n: left_of(curve, n) for n in numbers})
    return float(np.median(scale * np.sqrt(np.mean(curve**2, axis=1))))


def limited(curve: Array, most: float) -> Array:
    """(m, G) curves, those that are larger than `most` (rms) made as small as that."""
    size = np.sqrt(np.mean(curve**2, axis=1))
    return np.asarray(curve * np.minimum(1.0, most / np.where(size > 0.0, size, 1.0))[:, None])


def scales(numbers: Sequence[int], table: Sequence[float] | Array, left: Mapping[int, Array]) -> Array:
    """(m,) with which curves that leave left[N] (m,) meet a table at one N and exceed it at none."""
    scale = np.full(len(left[numbers[0]]), np.inf)
    for number, allowed in zip(numbers, table, strict=True):
        worst = left[number]
        scale = np.minimum(scale, allowed / np.where(worst > 0, worst, np.inf))
    return np.asarray(np.where(np.isfinite(scale), scale, 0.0))


@dataclass(frozen=True)
class OneUnits:
    """The curve measured on one unit, plus or minus. grid, values: (G,)."""

    grid: Array
    values: Array

    def drawn(self, count: int, rng: np.random.Generator) -> Array:
        """(count, G)."""
        return np.asarray(rng.choice(np.array([-1.0, 1.0]), size=count)[:, None] * self.values)


@dataclass(frozen=True)
class SeveralUnits:
    """Gaussian with the mean and the covariance (n − 1) of n units' curves. grid: (G,); values: (n, G)."""

    grid: Array
    values: Array

    def drawn(self, count: int, rng: np.random.Generator) -> Array:
        """(count, G)."""
        mean = self.values.mean(axis=0)
        z = rng.normal(size=(count, len(self.values)))
        return np.asarray(mean + z @ (self.values - mean) / np.sqrt(len(self.values) - 1.0))


def several_units(curves: Sequence[tuple[Array, Array]]) -> SeveralUnits:
    """Of the (temperatures, values) of each unit: on all their temperatures, linear between."""
    grid = np.unique(np.concatenate([t for t, _ in curves]))
    rows = [along(grid[None, :], t, v[None, None, :])[0, 0] for t, v in curves]
    return SeveralUnits(grid, np.array(rows))


def family(
    table: Mapping[int, float], low: float, high: float, figure: Figure, shape: str = "cosines"
) -> Family:
    """The curves of a shape over low … high degC that leave table[N] (SI) after N points."""
    numbers = tuple(sorted(table))
    left = np.array([table[n] for n in numbers])
    grid = np.linspace(low, high, POINTS)
    if shape == "cosines":
        return Family(shape, grid, numbers, left, figure, _amplitudes(numbers, left, figure))
    scale = _scale(ROWS[shape](), numbers, left) if figure == "sigma" else 1.0
    return Family(shape, grid, numbers, left, figure, np.zeros(MODES), scale)


def _amplitudes(numbers: Sequence[int], left: Array, figure: Figure) -> Array:
    from scipy.optimize import nnls

    asked = (left / (_PEAK if figure == "largest" else 1.0)) ** 2
    kept = asked > 0
    squares = np.array([_of_modes(n) for n in numbers])[kept] / asked[kept, None]
    power, _ = nnls(squares, np.ones(len(squares))) if kept.any() else (np.zeros(MODES), 0.0)
    if figure == "largest" and not power.any():
        power = np.arange(1, MODES + 1) ** -4.0
    return np.sqrt(power)


def _of_modes(points: int) -> Array:
    """(MODES,) mean square, over phase and x, of what a table leaves of each mode."""
    angle = angles(np.linspace(0.0, 1.0, _FINE))
    parts = [wave - tabled(wave, points) for wave in (np.cos(angle), np.sin(angle))]
    return np.asarray(sum(np.mean(part**2, axis=1) for part in parts) / 2.0)


def _scale(rows: Array, numbers: Sequence[int], left: Array) -> float:
    """The largest scale at which the rms of what N points leave exceeds left[N] at no N; rows (r, POINTS)."""
    rms = np.array([np.sqrt(np.mean((rows - tabled(rows, n)) ** 2, axis=1).sum()) for n in numbers])
    return float(np.min(left / rms))


def table_of(temperature_degc: Array, values: Array, low: float, high: float) -> dict[int, float]:
    """N -> the largest that N evenly spread points leave of one measured curve.

    N is at most 10 and less than its points: nobody measured between them, so as many leave nothing.
    """
    grid = np.linspace(low, high, POINTS)[None, :]
    curve = along(grid, temperature_degc, values[None, None, :])[0]
    most = min(MOST_POINTS, len(temperature_degc) - 1)
    left = {n: float(left_of(curve, n)[0]) for n in range(1, most + 1)}
    return {n: size for n, size in left.items() if size > ROUNDING * np.abs(curve).max()}


def left_of(curve: Array, points: int) -> Array:
    """(m,) the largest that N evenly spread points leave of curves (m, G)."""
    off = tabled(curve, points)
    off -= curve  # in place: fresh arrays take longer than the arithmetic
    return np.asarray(np.maximum(off.max(axis=1), -off.min(axis=1)))


def tabled(curve: Array, points: int) -> Array:
    """(m, G) what tables with evenly spread points give of curves (m, G); one point stands in the middle."""
    x = np.linspace(0.0, 1.0, curve.shape[1])
    nodes = np.linspace(0.0, 1.0, points) if points > 1 else np.array([0.5])
    left, share = between(x, nodes)
    values = curve[:, left] * (1.0 - share) + curve[:, left + 1] * share
    return np.asarray(values @ np.array([np.interp(x, nodes, row) for row in np.eye(len(nodes))]))


def between(grid: Array, x: Array) -> tuple[NDArray[np.intp], Array]:
    """Of x (...) the points of a grid (G,) to its left, and its share of the way to the next ones.

    Beyond the grid the end segments go on.
    """
    left = np.clip(np.searchsorted(grid, x, side="right") - 1, 0, len(grid) - 2)
    return left, np.asarray((x - grid[left]) / (grid[left + 1] - grid[left]))


def along(temperature_degc: Array, grid: Array, curve: Array) -> Array:
    """(B, t, K) curves (B, t, G) at temperatures (B, K); the end segments go on beyond the grid."""
    left, share = between(grid, temperature_degc)
    unit = np.arange(len(curve))[:, None]
    below = np.stack([curve[unit, t, left] for t in range(curve.shape[1])], axis=1)
    above = np.stack([curve[unit, t, left + 1] for t in range(curve.shape[1])], axis=1)
    return np.asarray(below + share[:, None, :] * (above - below))
