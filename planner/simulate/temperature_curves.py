"""Random error curves over temperature whose piecewise-linear residual follows a spec's table.

The table says what N evenly spread points leave (K table 2.10), not what the curves look like: families of
four shapes (`planner.simulate.curves`) leave the same table. Of every curve the mean is taken off. The
table's figure is either the `largest` residual: every curve is scaled until its largest residual meets the
table at one N and exceeds it at none; or `sigma`: the root mean square over temperature and curves. Cosines
meet a sigma by their amplitudes, the other shapes by one scale for the family: the largest with which the
root mean square exceeds the table at no N.

Where a table says little of slopes (it begins with two or three points, or falls steeply), nearly straight
cubics and kinks are scaled up as far as chance will have it: a share of k⁻² of them is k times as large, and
they have no second moment. No unit's curve is larger than LARGEST times the median of its family.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol

import numpy as np

from planner.nouns.array import Array
from planner.simulate.curves.cosines import cosines
from planner.simulate.curves.cubic import Cubic
from planner.simulate.curves.grid import POINTS, Real, Shape, along, centred, even_table, largest_left
from planner.simulate.curves.kink import Kink
from planner.simulate.curves.matern import Matern
from planner.spec.temperature_residual import CurveName

Figure = Literal["largest", "sigma"]

LARGEST = 10.0  # times the median rms of a family: beyond it are 0.8 % of cubics whose slopes no table says
MEDIAN_OF = 1000  # curves: known to 2 %, a second moment with it to 0.2 %


class CurveFamily(Protocol):
    """Random curves over temperature, each on one grid (G,), degC ascending."""

    @property
    def grid(self) -> Array:
        """(G,) temperatures at which a curve is given."""

    def draw(self, rng: np.random.Generator) -> Array:
        """(G,) one curve, SI."""

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, G) independent curves, SI."""

    def rows(self, count: int, rng: np.random.Generator) -> Array:
        """(r, G) R whose RᵀR is E f fᵀ: exactly, or where no formula says it, of `count` curves."""


@dataclass(frozen=True)
class TableCurves:
    """Curves of one shape over low … high that leave a table. numbers, residual: the table, SI.

    scale: of every curve for a sigma; for the largest residual each curve has its own
    """

    low_degc: float
    high_degc: float
    shape: Shape
    numbers: tuple[int, ...]
    residual: Array
    figure: Figure = "largest"
    scale: float = 1.0

    @property
    def grid(self) -> Array:
        """(POINTS,) temperatures at which a curve is given."""
        return np.linspace(self.low_degc, self.high_degc, POINTS)

    def draw(self, rng: np.random.Generator) -> Array:
        """(POINTS,) one curve, SI."""
        return np.asarray(self.draws(1, rng)[0])

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, POINTS) independent curves, SI."""
        curves = centred(self.shape.draws(count, rng))
        if self.figure == "sigma":
            return np.asarray(curves * self.scale)
        sizes, scales = sizes_of(curves), self._own_scales(curves)
        return np.asarray(curves * no_larger(scales, sizes, LARGEST * self._median)[:, None])

    @cached_property
    def _median(self) -> float:
        """Size in the middle of the family."""
        curves = centred(self.shape.evenly(MEDIAN_OF, np.random.default_rng(0)))
        return float(np.median(sizes_of(curves) * self._own_scales(curves)))

    def rows(self, count: int, rng: np.random.Generator) -> Array:
        """(r, POINTS) R, E f fᵀ = RᵀR: exact for a sigma, of `count` draws for the largest residual."""
        if self.figure == "sigma":
            return np.asarray(self.scale * centred(self.shape.rows()))
        return np.asarray(self.draws(count, rng) / np.sqrt(count))

    def _own_scales(self, curves: Real) -> Array:
        """(count,) with which each curve meets the table at one N and exceeds it at none."""
        scale = np.full(len(curves), np.inf)
        for number, allowed in zip(self.numbers, self.residual, strict=True):
            worst = largest_left(curves, number)
            scale = np.minimum(scale, allowed / np.where(worst > 0, worst, np.inf))
        return np.asarray(np.where(np.isfinite(scale), scale, 0.0))


def sizes_of(curves: Real) -> Array:
    """(n,) root mean squares over the range of curves (n, POINTS)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", curves, curves) / POINTS), dtype=np.float64)


def no_larger(scales: Array, sizes: Array, most: float) -> Array:
    """(n,) scales with which no curve of sizes (n,) is larger than `most`."""
    limit = most / np.where(sizes > 0.0, sizes, np.inf)
    return np.where(sizes > 0.0, np.minimum(scales, limit), scales)


def curve_family(
    table: Mapping[int, float],
    low_degc: float,
    high_degc: float,
    figure: Figure = "largest",
    shape: CurveName = "cosines",
) -> TableCurves:
    """The curves of a shape whose residual after N points is table[N] (SI)."""
    numbers = tuple(sorted(table))
    residual = np.array([table[n] for n in numbers])
    made = _shape(shape, table, figure)
    scale = 1.0 if figure == "largest" or shape == "cosines" else _one_scale(made, numbers, residual)
    return TableCurves(low_degc, high_degc, made, numbers, residual, figure, scale)


def _shape(name: CurveName, table: Mapping[int, float], figure: Figure) -> Shape:
    if name == "cosines":
        return cosines(table, largest=figure == "largest")
    shapes: Mapping[CurveName, type[Shape]] = {"kink": Kink, "cubic": Cubic, "matern": Matern}
    return shapes[name]()


def _one_scale(shape: Shape, numbers: tuple[int, ...], residual: Array) -> float:
    """The largest with which the rms of what N points leave exceeds the table at no N."""
    rows = centred(shape.rows())
    left = [np.sum((rows - even_table(rows, n)) ** 2) / POINTS for n in numbers]
    return float(np.min(residual / np.sqrt(left), initial=np.inf)) if numbers else 0.0


def second_moment(family: CurveFamily, degc: Array, count: int, rng: np.random.Generator) -> Array:
    """(k, k) E f fᵀ at temperatures (k,); where no formula gives it, the mean over `count` drawn curves."""
    seen = along(degc, family.grid, family.rows(count, rng))
    return np.asarray(seen.T @ seen)
