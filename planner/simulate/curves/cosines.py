"""Cosines of random phase whose amplitudes make the residual fall with N as a table does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from planner.nouns.array import Array
from planner.simulate.curves.grid import Shape, Single, places

MODES = 40
_PEAK_OVER_RMS = 2.2  # of what a table leaves of such a curve
_FINE = 241  # places at which a mode's residual is averaged


@dataclass(frozen=True)
class Cosines(Shape):
    """f(x) = Σ a_m cos(mπx + φ_m), φ_m uniform; amplitude: (MODES,) a_m."""

    amplitude: Array

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, POINTS) independent curves."""
        return np.asarray(np.hstack(self._parts(count, rng)) @ np.vstack(_waves()))

    def evenly(self, count: int, rng: np.random.Generator) -> Single:
        """(count, POINTS) independent curves."""
        each, waves = np.hstack(self._parts(count, rng)), np.vstack(_waves())
        return np.asarray(each.astype(np.float32) @ waves.astype(np.float32))

    def _parts(self, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """(count, MODES) of the cosines and of the sines."""
        phase = rng.uniform(0.0, 2.0 * np.pi, (count, MODES))
        return self.amplitude * np.cos(phase), -self.amplitude * np.sin(phase)

    def rows(self) -> Array:
        """(2·MODES, POINTS): E cos² = E sin² = ½, and nothing else is left."""
        return np.vstack([np.sqrt(0.5) * self.amplitude[:, None] * wave for wave in _waves()])


@cache
def _waves() -> tuple[Array, Array]:
    """(MODES, POINTS) cosines and sines."""
    angle = np.pi * np.arange(1, MODES + 1)[:, None] * places()
    return np.cos(angle), np.sin(angle)


@cache
def _mode_residuals(points: int) -> Array:
    """(MODES,) mean square, over phase and temperature, of what a table leaves of cos(mπx + φ)."""
    x = np.linspace(0.0, 1.0, _FINE)
    nodes = np.linspace(0.0, 1.0, points) if points > 1 else np.array([0.5])
    found = np.zeros(MODES)
    for phase in (0.0, np.pi / 2.0):  # the mean over all phases is the mean of sine and cosine
        for m in range(1, MODES + 1):
            wave = np.cos(np.pi * m * x + phase)
            found[m - 1] += np.mean((wave - np.interp(x, nodes, np.interp(nodes, x, wave))) ** 2) / 2.0
    return found


def cosines(table: Mapping[int, float], *, largest: bool) -> Cosines:
    """Cosines whose residual falls as the table's, relative to each number; a zero cannot be met.

    largest: the table's numbers are about 2.2 rms; where all are zero any amplitudes do, the scale is zero.
    A sigma is met in the least-squares sense: the published tables at every N to 6 %.
    """
    from scipy.optimize import nnls

    met = {n: table[n] / (_PEAK_OVER_RMS if largest else 1.0) for n in sorted(table) if table[n] > 0}
    if not met:
        return Cosines(np.arange(1.0, MODES + 1) ** -2.0 if largest else np.zeros(MODES))
    shares = np.array([_mode_residuals(n) / sigma**2 for n, sigma in met.items()])
    power, _ = nnls(shares, np.ones(len(met)))
    return Cosines(np.sqrt(power))
