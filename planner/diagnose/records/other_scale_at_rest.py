"""Gyros at rest that were written in another unit of measurement: rad/s under deg/s in a power-on of faces.

What a gyro reads at rest is its bias, no multiple of its reference. But from face to face the Earth's rate
turns over, and about the means of a power-on, all three gyros together,

    k = Σ y′·u′ / Σ u′·u′,   s² = Σ |y′ − k u′|² / (3 (n − 1) − 1)

k is 1 and s the noise; of a power-on in a unit f times as large both are f times as much, and so is what the
mean of it reads. Each of the three must say so, beside a k that the noise tells from 1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable

LEAST_RUNS = 4  # power-ons with faces, of which the middle one says what is usual
ROWS = 4  # of a power-on
TOLD = 5.0  # sigma, by which the Earth's rate must be told from what the unit would make of it
ALIKE = 3.0  # times the usual noise, or below a third of it: power-ons of one unit of measurement
LARGEST = 3.0  # times the level of any other power-on: 0.02 deg/s are 1.2 deg/s if converted twice


@dataclass(frozen=True)
class _Rests:
    """Of power-ons with faces: run, k, s, the sigma of a k (g,) at the usual s, and the level of the mean."""

    run: NDArray[np.int64]
    k: Array
    s: Array
    sigma: Array
    level: Array


def scaled_at_rest(
    table: DwellTable, rests: NDArray[np.bool_], factors: Sequence[float]
) -> Iterator[tuple[int, float]]:
    """Power-ons whose gyros read one of these factors times what they are exposed to, and that factor.

    rests: (n,) rows at rest; of a power-on that turns as well its turns tell it (`other_scale`)
    """
    seen = _of_power_ons(table, rests)
    if seen is None or len(seen.run) < LEAST_RUNS:
        return
    usual = float(np.median(seen.s))
    for i, run in enumerate(seen.run.tolist()):
        others = float(np.delete(seen.level, i).max())
        for f in factors:
            sigma = max(f, 1.0) * seen.sigma[i]
            told = abs(1.0 - f) > TOLD * sigma and abs(seen.k[i] - f) < TOLD * f * seen.sigma[i]
            as_noisy = 1.0 / ALIKE < seen.s[i] / (f * usual) < ALIKE
            if told and as_noisy and seen.level[i] < LARGEST * f * others:
                yield run, f
                break


def _of_power_ons(table: DwellTable, rests: NDArray[np.bool_]) -> _Rests | None:
    if table.gyro is None or table.ref_rate is None:
        return None
    runs, which, count = np.unique(table.run, return_inverse=True, return_counts=True)
    still = np.bincount(which, rests) == count
    told = still & (count >= ROWS)
    y, u = table.gyro, table.ref_rate
    mean = np.array([_means(x, which, count) for x in (y, u)])
    about_y, about_u = y - mean[0][which], u - mean[1][which]
    square = np.bincount(which, np.sum(about_u**2, axis=1))
    told &= square > 0.0
    if not told.any():
        return None
    square = np.where(told, square, 1.0)
    k = np.bincount(which, np.sum(about_y * about_u, axis=1)) / square
    left = np.sum((about_y - k[which][:, None] * about_u) ** 2, axis=1)
    s = np.sqrt(np.bincount(which, left) / np.maximum(3.0 * (count - 1.0) - 1.0, 1.0))
    usual = float(np.median(s[told]))
    level = np.linalg.norm(mean[0], axis=1)
    return _Rests(runs[told], k[told], s[told], usual / np.sqrt(square[told]), level[told])


def _means(x: Array, which: NDArray[np.int64], count: NDArray[np.int64]) -> Array:
    return np.array([np.bincount(which, c) for c in x.T]).T / count[:, None]
