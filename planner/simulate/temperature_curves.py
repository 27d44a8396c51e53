"""Random error curves over temperature whose piecewise-linear residual follows a spec's table.

The table says what N evenly spread points leave (K table 2.10). A curve is a sum of cosines of random phase;
their amplitudes are such that the residual falls with N as the table does. The table's figure is either the
`largest` residual: every curve is scaled until its largest residual meets the table at one N and exceeds it
at none; or `sigma`: the amplitudes are such that the root mean square over temperature and curves is the
figure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner.nouns.array import Array

POINTS = 481
_MODES = 40
_PEAK_OVER_RMS = 2.2  # of what a table leaves of such a curve
Figure = Literal["largest", "sigma"]


@dataclass(frozen=True)
class CurveFamily:
    """Curves over one range. amplitude: (m,) of the modes; numbers, residual: the table, SI.

    cosine, sine: (POINTS, m) the modes on the grid; figure: what the table's numbers are
    """

    low_degc: float
    high_degc: float
    amplitude: Array
    numbers: tuple[int, ...]
    residual: Array
    cosine: Array
    sine: Array
    figure: Figure = "largest"

    @property
    def grid(self) -> Array:
        """(POINTS,) temperatures at which a curve is given."""
        return np.linspace(self.low_degc, self.high_degc, POINTS)

    def draw(self, rng: np.random.Generator) -> Array:
        """(POINTS,) one curve, SI."""
        phase = rng.uniform(0.0, 2.0 * np.pi, _MODES)
        curve = self.cosine @ (self.amplitude * np.cos(phase)) - self.sine @ (self.amplitude * np.sin(phase))
        curve -= curve.mean()
        if self.figure == "sigma":
            return np.asarray(curve)
        worst = np.array([np.abs(curve - even_table(curve, n)).max() for n in self.numbers])
        scale = float(np.min(self.residual / np.where(worst > 0, worst, np.inf), initial=np.inf))
        return np.asarray(curve * (scale if np.isfinite(scale) else 0.0))


def second_moment(family: CurveFamily, degc: Array, count: int, rng: np.random.Generator) -> Array:
    """(k, k) mean of f fᵀ at temperatures (k,) over `count` curves as `CurveFamily.draw` gives them."""
    phase = rng.uniform(0.0, 2.0 * np.pi, (count, _MODES))
    curves = (family.amplitude * np.cos(phase)) @ family.cosine.T
    curves -= (family.amplitude * np.sin(phase)) @ family.sine.T
    curves -= curves.mean(axis=1, keepdims=True)
    if family.figure == "largest":
        worst = np.array([np.abs(curves - _even_tables(curves, n)).max(axis=1) for n in family.numbers])
        scale = np.min(family.residual[:, None] / np.where(worst > 0, worst, np.inf), axis=0)
        curves *= np.where(np.isfinite(scale), scale, 0.0)[:, None]
    seen = np.array([along(degc, family.grid, curve) for curve in curves])
    return np.asarray(seen.T @ seen / count)


def _even_tables(curves: Array, points: int) -> Array:
    """(N, POINTS) what `even_table` gives of each of many curves (N, POINTS)."""
    nodes = np.linspace(0.0, 1.0, points) if points > 1 else np.array([0.5])
    place = nodes * (POINTS - 1)
    left = np.minimum(place.astype(int), POINTS - 2)
    values = curves[:, left] * (1.0 - (place - left)) + curves[:, left + 1] * (place - left)
    x = np.linspace(0.0, 1.0, POINTS)
    return np.asarray(values @ np.array([np.interp(x, nodes, row) for row in np.eye(points)]))


def along(temperature_degc: Array, grid: Array, curve: Array) -> Array:
    """(n,) the curve at temperatures; its end segments go on beyond the grid."""
    inside = np.interp(temperature_degc, grid, curve)
    below, above = (
        (curve[1] - curve[0]) / (grid[1] - grid[0]),
        (curve[-1] - curve[-2]) / (grid[-1] - grid[-2]),
    )
    low, high = np.minimum(temperature_degc - grid[0], 0.0), np.maximum(temperature_degc - grid[-1], 0.0)
    return np.asarray(inside + below * low + above * high)


def even_table(curve: Array, points: int) -> Array:
    """(POINTS,) what a table with `points` evenly spread points gives; one point gives the middle value."""
    x = np.linspace(0.0, 1.0, len(curve))
    nodes = np.linspace(0.0, 1.0, points) if points > 1 else np.array([0.5])
    return np.asarray(np.interp(x, nodes, np.interp(nodes, x, curve)))


def curve_family(
    table: Mapping[int, float], low_degc: float, high_degc: float, figure: Figure = "largest"
) -> CurveFamily:
    """The curves whose residual after N points is table[N] (SI).

    Where the figure is a sigma, they meet it in the least-squares sense: the published tables at every N to
    6 %. A sigma of zero cannot be met and is left out.
    """
    from scipy.optimize import nnls

    numbers = tuple(sorted(table))
    residual = np.array([table[n] for n in numbers])
    response = np.array([[_mode_residual(m, n) for m in range(1, _MODES + 1)] for n in numbers])
    # squares of amplitudes, each equation relative to its own residual
    weight = (residual / (_PEAK_OVER_RMS if figure == "largest" else 1.0)) ** 2
    keep = weight > 0
    power: Array = np.zeros(_MODES)
    if keep.any():
        power, _ = nnls(response[keep] / weight[keep, None], np.ones(int(keep.sum())))
    if figure == "largest" and not power.any():
        power = np.arange(1.0, _MODES + 1) ** -4.0
    waves = np.pi * np.linspace(0.0, 1.0, POINTS)[:, None] * np.arange(1, _MODES + 1)
    modes = np.cos(waves), np.sin(waves)
    return CurveFamily(low_degc, high_degc, np.sqrt(power), numbers, residual, *modes, figure)


def _mode_residual(mode: int, points: int) -> float:
    """Mean square, over phase and temperature, of what a table leaves of cos(mode π x + φ)."""
    x = np.linspace(0.0, 1.0, 241)
    left = 0.0
    for phase in (0.0, np.pi / 2.0):  # the mean over all phases is the mean of sine and cosine
        wave = np.cos(np.pi * mode * x + phase)
        left += float(np.mean((wave - even_table(wave, points)) ** 2)) / 2.0
    return left
