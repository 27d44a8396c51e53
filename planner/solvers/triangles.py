"""Lower triangles: their inverse, and products with them, at a fourth and half of any matrix's work."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

_SMALL = 12  # columns, of which to ask each for its inverse takes longer than the work itself


def inverse_of_triangle(L: NDArray[np.floating[Any]]) -> Array:
    """L⁻¹ of a lower triangle (r, r)."""
    from scipy.linalg.lapack import dtrtri

    if not L.size:
        return np.asarray(L, dtype=float)
    return np.asarray(dtrtri(L.T)[0].T, dtype=float)  # an upper one by columns: as it lies, not turned over


def inverse_of_triangles(L: Array) -> Array:
    """L⁻¹ of each of some lower triangles (G, r, r)."""
    if L.shape[1] < _SMALL:
        return np.asarray(np.linalg.inv(L))
    return np.array([inverse_of_triangle(one) for one in L])


def times_transposed(X: Array, L: Array) -> Array:
    """X Lᵀ (n, r) of X (n, r) and a lower triangle (r, r)."""
    from scipy.linalg.blas import dtrmm

    if not L.size:
        return np.asarray(X @ L.T)
    return np.asarray(dtrmm(1.0, L.T, X.T, trans_a=1).T)
