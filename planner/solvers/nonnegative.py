"""Least squares with coefficients that are not negative: Lawson and Hanson's active set.

The same answer as scipy.optimize.nnls, whose import takes 0.25 s; here a handful of variances ask for it.
Source: Lawson, Hanson, Solving Least Squares Problems, 1974, 23.3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

_ROUNDING = 1e-13  # of |A| |b|, below which a slope is none


def nonnegative_least_squares(A: Array, b: Array) -> Array:
    """(k,) x >= 0 that minimises |A x − b|; A: (m, k) of full rank, b: (m,).

    Raises ValueError when the active set does not settle, as in a design with columns that are the same.
    """
    x, taken = np.zeros(A.shape[1]), np.zeros(A.shape[1], dtype=bool)
    least = _ROUNDING * float(np.abs(A).max(initial=0.0) * np.abs(b).max(initial=0.0)) * len(b)
    for _ in range(30 * max(len(x), 1)):
        uphill = np.where(taken, -np.inf, A.T @ (b - A @ x))
        if taken.all() or uphill.max() <= least:
            return x
        taken[np.argmax(uphill)] = True
        wanted = _free(A, b, taken)
        while (wanted[taken] <= 0.0).any():
            falls = taken & (wanted <= 0.0)
            share = x[falls] / (x[falls] - wanted[falls])
            x = x + float(share.min()) * (wanted - x)
            taken[np.flatnonzero(falls)[np.argmin(share)]] = False
            x = np.where(taken, x, 0.0)
            wanted = _free(A, b, taken)
        x = wanted
    raise ValueError("the active set of a non-negative least squares problem does not settle")


def _free(A: Array, b: Array, taken: NDArray[np.bool_]) -> Array:
    """(k,) least squares over the columns taken, zero elsewhere."""
    out = np.zeros(A.shape[1])
    out[taken] = np.linalg.lstsq(A[:, taken], b, rcond=None)[0]
    return out
