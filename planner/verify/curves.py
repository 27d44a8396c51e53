"""Random curves over temperature that leave what the spec's table says, by verify's own arithmetic.

A curve is Σ a_m cos(mπx + φ_m), x from 0 to 1 over the range, phases at random, its mean taken off. The a_m
are such that N evenly spread points with straight lines leave, over phases and temperatures, mean squares
that fall with N as the table does. `figure: largest`: each curve is scaled until its largest residual meets
the table at one N and exceeds it at none, 2.2 being peak over rms of what is left; `sigma`: the mean square
itself is the table's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner.nouns.array import Array

POINTS = 481
MODES = 40
_PEAK = 2.2
_FINE = 241  # points at which a mode's residual is averaged


@dataclass(frozen=True)
class Family:
    """Curves over one range. grid: (POINTS,) degC; amplitude: (MODES,); numbers, left: the table, SI."""

    grid: Array
    amplitude: Array
    numbers: tuple[int, ...]
    left: Array
    figure: Literal["largest", "sigma"]

    def drawn(self, phase: Array) -> Array:
        """(m, POINTS) curves of phases (m, MODES), SI."""
        x = np.linspace(0.0, 1.0, POINTS)
        angle = np.pi * np.arange(1, MODES + 1)[:, None] * x
        curve = (self.amplitude * np.cos(phase)) @ np.cos(angle)
        curve -= (self.amplitude * np.sin(phase)) @ np.sin(angle)
        curve -= curve.mean(axis=1, keepdims=True)
        if self.figure == "sigma":
            return np.asarray(curve)
        scale = np.full(len(curve), np.inf)
        for number, allowed in zip(self.numbers, self.left, strict=True):
            worst = np.abs(curve - tabled(curve, number)).max(axis=1)
            scale = np.minimum(scale, allowed / np.where(worst > 0, worst, np.inf))
        return np.asarray(curve * np.where(np.isfinite(scale), scale, 0.0)[:, None])


def family(
    table: Mapping[int, float], low: float, high: float, figure: Literal["largest", "sigma"]
) -> Family:
    """The curves over low … high degC that leave table[N] (SI) after N points."""
    from scipy.optimize import nnls

    numbers = tuple(sorted(table))
    left = np.array([table[n] for n in numbers])
    asked = (left / (_PEAK if figure == "largest" else 1.0)) ** 2
    kept = asked > 0
    squares = np.array([_of_modes(n) for n in numbers])[kept] / asked[kept, None]
    power, _ = nnls(squares, np.ones(len(squares))) if kept.any() else (np.zeros(MODES), 0.0)
    if figure == "largest" and not power.any():
        power = np.arange(1, MODES + 1) ** -4.0
    return Family(np.linspace(low, high, POINTS), np.sqrt(power), numbers, left, figure)


def _of_modes(points: int) -> Array:
    """(MODES,) mean square, over phase and x, of what a table leaves of each mode."""
    x = np.linspace(0.0, 1.0, _FINE)
    angle = np.pi * np.arange(1, MODES + 1)[:, None] * x
    parts = [wave - tabled(wave, points) for wave in (np.cos(angle), np.sin(angle))]
    return np.asarray(sum(np.mean(part**2, axis=1) for part in parts) / 2.0)


def tabled(curve: Array, points: int) -> Array:
    """(m, G) what tables with evenly spread points give of curves (m, G); one point stands in the middle."""
    x = np.linspace(0.0, 1.0, curve.shape[1])
    nodes = np.linspace(0.0, 1.0, points) if points > 1 else np.array([0.5])
    left = np.clip(np.searchsorted(x, nodes, side="right") - 1, 0, len(x) - 2)
    share = (nodes - x[left]) / (x[left + 1] - x[left])
    values = curve[:, left] * (1.0 - share) + curve[:, left + 1] * share
    return np.asarray(values @ np.array([np.interp(x, nodes, row) for row in np.eye(len(nodes))]))


def along(temperature_degc: Array, grid: Array, curve: Array) -> Array:
    """(B, t, K) curves (B, t, G) at temperatures (B, K); the end segments go on beyond the grid."""
    left = np.clip(np.searchsorted(grid, temperature_degc, side="right") - 1, 0, len(grid) - 2)
    share = (temperature_degc - grid[left]) / (grid[left + 1] - grid[left])
    unit = np.arange(len(curve))[:, None]
    below = np.stack([curve[unit, t, left] for t in range(curve.shape[1])], axis=1)
    above = np.stack([curve[unit, t, left + 1] for t in range(curve.shape[1])], axis=1)
    return np.asarray(below + share[:, None, :] * (above - below))
