"""Curves that were measured: on one unit, up to its sign; on several, a Gaussian with their covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array
from planner.simulate.curves.grid import along, largest_left, places
from planner.spec.temperature_residual import MeasuredCurve

MOST_POINTS = 10  # of the table that one unit's curve leaves
_NOTHING = 1e-9  # of the largest: straight lines between as many measured points leave rounding


@dataclass(frozen=True)
class OneUnit:
    """Plus or minus the measured curve. grid: (n,) degC; values: (n,) SI."""

    grid: Array
    values: Array

    def draw(self, rng: np.random.Generator) -> Array:
        """(n,) one curve, SI."""
        return np.asarray(rng.choice([-1.0, 1.0]) * self.values)

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, n) independent curves, SI."""
        return np.asarray(rng.choice([-1.0, 1.0], size=(count, 1)) * self.values)

    def rows(self, count: int, rng: np.random.Generator) -> Array:
        """(1, n): its square is the second moment, whatever the sign."""
        return self.values[None, :]


@dataclass(frozen=True)
class SeveralUnits:
    """A Gaussian with the mean (n,) and the deviations (u, n) of u units' curves, SI, at grid (n,) degC.

    The deviations are divided by √(u − 1): their square is the covariance.
    """

    grid: Array
    mean: Array
    deviations: Array

    def draw(self, rng: np.random.Generator) -> Array:
        """(n,) one curve, SI."""
        return np.asarray(self.draws(1, rng)[0])

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, n) independent curves, SI."""
        return np.asarray(self.mean + rng.normal(size=(count, len(self.deviations))) @ self.deviations)

    def rows(self, count: int, rng: np.random.Generator) -> Array:
        """(1 + u, n): mean and deviations, whose squares add up to the second moment."""
        return np.vstack([self.mean, self.deviations])


def one_unit(measured: MeasuredCurve) -> OneUnit:
    """The family that a curve measured on one unit is by itself."""
    return OneUnit(measured.temperatures_degc, measured.values)


def several_units(measured: Sequence[MeasuredCurve]) -> SeveralUnits:
    """The family of curves measured on several units, straight between their points and beyond the last."""
    grid = np.unique(np.concatenate([m.temperatures_degc for m in measured]))
    curves = np.array([along(grid, m.temperatures_degc, m.values) for m in measured])
    mean = curves.mean(axis=0)
    return SeveralUnits(grid, mean, (curves - mean) / np.sqrt(len(curves) - 1))


def table_of(measured: MeasuredCurve, low_degc: float, high_degc: float) -> dict[int, float]:
    """N -> the largest residual (SI) that N even points over low … high leave of one unit's curve.

    N is at most 10 and less than the number of measured points: nobody measured what is between them, so as
    many even points as that, or whatever else meets all its corners, leave nothing but rounding.
    """
    grid = low_degc + (high_degc - low_degc) * places()
    curve = along(grid, measured.temperatures_degc, measured.values)
    most = min(MOST_POINTS, len(measured.curve) - 1)
    left = {n: float(largest_left(curve, n)) for n in range(1, most + 1)}
    least = _NOTHING * float(np.abs(curve).max())
    return {n: value for n, value in left.items() if value > least}
