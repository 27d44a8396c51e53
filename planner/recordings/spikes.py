"""Spikes of a millisecond or two, to zero, full scale or anywhere (K 4.3.3), against a running median.

A spike of at most k samples leaves the median of 2k + 1 samples untouched, so x − median stands out against
the recording's own noise; whatever lasts longer is no spike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

LONGEST_S = 0.002
THRESHOLD = 8.0  # about one sample in 1e10 of Gaussian noise passes it
# 68 % quantile of |x − median of 2k + 1| for noise of unit spread, at k samples; by drawing 2e6 of them
QUANTILE = 0.68
MEDIAN_CHANGE = 0.9539  # median of |x − y| for noise of unit spread: √2 · 0.6745
SPIKE_LENGTHS = (1, 2, 3, 4, 6, 10, 20)
QUANTILES = (0.7248, 0.8616, 0.9084, 0.9291, 0.9525, 0.9706, 0.9814)
BLOCK_S = 0.25  # over which the noise is taken: shorter than a turn
BLOCK_SAMPLES = (40, 1000)


def longest_spike(rate: float) -> int:
    """The number of samples that a spike may last at a sampling rate in Hz; at least one."""
    return max(1, min(20, round(LONGEST_S * rate)))


def block_length(rate: float) -> int:
    """The number of samples over which the noise is taken."""
    return min(max(round(BLOCK_S * rate), BLOCK_SAMPLES[0]), BLOCK_SAMPLES[1])


def spikes(values: Array, length: int, block: int = 256) -> NDArray[np.bool_]:
    """(n,) samples of (n, k) channels in which some channel has a spike of at most `length` samples.

    |x − med| > 8 σ. σ is the largest of three: the 68 % quantile of |x − med| over the block around; the
    median change from sample to sample there, which a motion makes large; the step of the digits.
    """
    if len(values) < 2 * length + 1:
        return np.zeros(len(values), dtype=bool)
    residual = np.abs(values - running_median(values, length))
    unit = float(np.interp(length, SPIKE_LENGTHS, QUANTILES))
    change = np.abs(np.diff(values, axis=0, prepend=values[:1]))
    noise = np.maximum(_around(residual, QUANTILE, block) / unit, _around(change, 0.5, block) / MEDIAN_CHANGE)
    limit = THRESHOLD * np.maximum(noise, _digit(values))
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


def _around(size: Array, share: float, block: int) -> Array:
    """(n, k) quantile of (n, k) sizes about each sample, the largest of its block and both neighbours.

    Not under what a tenth of the blocks have, so that a block that stands still does not make the next odd.
    """
    n = len(size)
    blocks = max(1, n // block)
    cut = size[: blocks * block] if n >= block else size
    local = np.quantile(cut.reshape(blocks, -1, size.shape[1]), share, axis=1)
    near = np.pad(local, ((1, 1), (0, 0)), mode="edge")
    wide = np.maximum(np.maximum(near[:-2], near[1:-1]), near[2:])
    wide = np.maximum(wide, np.quantile(local, 0.1, axis=0))
    return wide[np.minimum(np.arange(n) // block, blocks - 1)]


def _digit(values: Array) -> Array:
    """(k,) the step of the digits of each channel: the least difference between neighbours that is not 0."""
    step = np.abs(np.diff(values[:4096], axis=0))
    step[step == 0] = np.inf
    least = step.min(axis=0)
    return np.where(np.isfinite(least), least, 0.0)
