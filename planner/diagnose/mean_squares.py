"""Root mean squares of what is left: with intervals, about means of power-ons, and of replicates alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.distributions import student_quantile

CONFIDENCE = 0.95  # of the intervals, as calibrate gives them


def about_means(A: Array, group: NDArray[np.int64], weight: Array | float = 1.0) -> Array:
    """(n, k) rows about the mean of each group: what is common to a power-on is no error within it."""
    _, number = np.unique(group, return_inverse=True)
    weights = np.broadcast_to(weight, len(A))
    total = np.bincount(number, weights)
    means = np.array([np.bincount(number, weights * column) / total for column in A.T])
    return np.asarray(A - means.T[number]) if A.shape[1] else A


def mean_square(residual: Array, group: NDArray[np.int64]) -> tuple[float, float, float]:
    """Root mean square with its 95 % interval: power-ons are what varies independently.

    The mean square is a ratio of sums over groups; its logarithm gets Student's t with groups − 1 degrees
    of freedom on the linearised variance (Cochran, Sampling Techniques, 1977, 6.4).
    """
    _, number = np.unique(group, return_inverse=True)
    squares, sizes = np.bincount(number, residual**2), np.bincount(number)
    mean = float(squares.sum() / sizes.sum())
    groups = len(sizes)
    if groups < 2 or mean == 0.0:
        return float(np.sqrt(mean)), float("nan"), float("nan")
    scatter = float(np.sum((squares - mean * sizes) ** 2)) * groups / (groups - 1.0) / sizes.sum() ** 2
    half = float(student_quantile((1.0 + CONFIDENCE) / 2.0, groups - 1.0)) * np.sqrt(scatter) / mean
    return tuple(float(np.sqrt(mean * np.exp(sign * half))) for sign in (0.0, -1.0, 1.0))  # type: ignore[return-value]  # of three signs, three values


def within(residual: Array, group: NDArray[np.int64], sigma: Array | float = 1.0) -> float:
    """Root mean square about the mean of each group, in units of sigma; NaN when every group is one row.

    The mean is taken off first, each row with its weight 1 / sigma²: records of one power-on that last
    unequally long have its level in common, but not in units of their own noise.
    """
    freedom = len(residual) - len(np.unique(group))
    if freedom < 1:
        return float("nan")
    return float(np.sqrt(squares(residual, group, sigma) / freedom))


def squares(residual: Array, group: NDArray[np.int64], sigma: Array | float) -> float:
    """Sum of squares about the weighed mean of each group, in units of sigma."""
    left = about_means(residual[:, None], group, np.power(sigma, -2.0))[:, 0] / sigma
    return float(left @ left)


def noise_floor(residual: Array, group: NDArray[np.int64], cells: NDArray[np.int64]) -> tuple[float, float]:
    """Pure error from replicates: root mean square about the mean of rows made alike; in all, within runs.

    No model of that instrument leaves less. NaN without replicates.
    """
    total = within(residual, cells)
    freedom = len(residual) - len(np.unique(group))
    if freedom < 1:
        return total, float("nan")
    left = about_means(residual[:, None], group)[:, 0]
    return total, within(left, cells) * float(np.sqrt(len(residual) / freedom))
