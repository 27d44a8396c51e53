"""Spikes of a millisecond or two, to zero, to full scale or anywhere (K 4.3.3): found against a running median.

A spike of at most k samples leaves the median of 2k + 1 samples untouched, so x − median stands out against
the recording's own noise; whatever lasts longer is no spike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.records import Array

LONGEST_S = 0.002
THRESHOLD = 7.0  # a false alarm in 4e11 samples of Gaussian noise
BLOCK = 256  # samples over which the noise is taken: a quarter of a second at 1 kHz


def longest_spike(rate: float) -> int:
    """The number of samples that a spike may last at a sampling rate in Hz; at least one."""
    return max(1, min(20, round(LONGEST_S * rate)))


def spikes(values: Array, length: int) -> NDArray[np.bool_]:
    """(n,) samples of (n, k) channels in which some channel has a spike of at most `length` samples.

    |x − med| > 7 σ, σ from the 68 % quantile of |x − med| over the block around and not under the step of the
    digits, so that neither a slow motion nor coarse digits count as spikes.
    """
    if len(values) < 2 * length + 1:
        return np.zeros(len(values), dtype=bool)
    residual = np.abs(values - running_median(values, length))
    limit = THRESHOLD * np.maximum(_noise(residual), _digit(values))
    return np.asarray((residual > limit).any(axis=1))


def running_median(values: Array, length: int) -> Array:
    """(n, k) median of the 2·length + 1 samples around each; at the ends the last sample is repeated."""
    padded = np.pad(values, ((length, length), (0, 0)), mode="edge")
    n = len(values)
    v = [padded[i : i + n] for i in range(2 * length + 1)]
    if length == 1:
        return _median3(*v)
    if length == 2:
        low, high = np.minimum(v[0], v[1]), np.maximum(v[0], v[1])
        low2, high2 = np.minimum(v[3], v[4]), np.maximum(v[3], v[4])
        return _median3(v[2], np.maximum(low, low2), np.minimum(high, high2))
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, size=(2 * length + 1, 1), mode="nearest"))


def _median3(a: Array, b: Array, c: Array) -> Array:
    return np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))


def _noise(residual: Array) -> Array:
    """(n, k) the larger of the noise around each sample (block and neighbours) and of the whole piece."""
    n = len(residual)
    blocks = max(1, n // BLOCK)
    cut = residual[: blocks * BLOCK] if n >= BLOCK else residual
    local = np.quantile(cut.reshape(blocks, -1, residual.shape[1]), 0.68, axis=1)
    near = np.pad(local, ((1, 1), (0, 0)), mode="edge")
    wide = np.maximum(np.maximum(near[:-2], near[1:-1]), near[2:])
    wide = np.maximum(wide, np.quantile(local, 0.1, axis=0))
    return wide[np.minimum(np.arange(n) // BLOCK, blocks - 1)]


def _digit(values: Array) -> Array:
    """(k,) the step of the digits of each channel: the least difference between neighbours that is not 0."""
    step = np.abs(np.diff(values[:4096], axis=0))
    step[step == 0] = np.inf
    least = step.min(axis=0)
    return np.where(np.isfinite(least), least, 0.0)
