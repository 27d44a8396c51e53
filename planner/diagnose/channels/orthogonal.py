"""Bases of columns, and columns clear of a basis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.least_squares import orthogonal
from planner.solvers.triangles import inverse_of_triangle


def orthonormal(A: Array, seen: float = 1e-9) -> Array:
    """(n, r) basis of the columns of A, scaled first; directions below `seen` of the largest left out."""
    length = np.linalg.norm(A, axis=0)
    A = A[:, length > 0] / length[length > 0]
    if A.shape[1] == 0:
        return np.empty((len(A), 0))
    q, r = orthogonal(A)
    if _all_seen(r, seen):
        return q
    u, s = _left(r)
    return np.asarray(q @ u[:, : len(s)][:, s > seen * s[0]])


def _all_seen(r: Array, seen: float) -> bool:
    """Whether no direction of a triangle is left out.

    1 / |R⁻¹| is no more than its smallest singular value. Where that is too small its singular values alone,
    a quarter of the work.
    """
    if r.shape[0] == r.shape[1] and np.diag(r).all():
        with np.errstate(over="ignore", invalid="ignore"):  # of columns that are nearly one it is anything
            most = seen * np.linalg.norm(inverse_of_triangle(r.T)) * np.linalg.norm(r)
        if most < 1.0:
            return True
    try:
        s = np.linalg.svd(r, compute_uv=False)
    except np.linalg.LinAlgError:
        return False
    return bool(s[-1] > seen * s[0])


def _left(r: Array) -> tuple[Array, Array]:
    """Left singular vectors and singular values of a triangle; by the slow way where the quick one fails.

    LAPACK's division and conquest (gesdd) does not converge on some triangles whose smallest values are
    rounding; QR sweeps (gesvd) do.
    """
    try:
        u, s, _ = np.linalg.svd(r)
    except np.linalg.LinAlgError:
        from scipy.linalg import svd

        u, s, _ = svd(r, lapack_driver="gesvd")
    return u, s


def clear(Q: Array, A: Array) -> Array:
    """(I − QQᵀ) A, twice, because raw values are 1e5 times the noise."""
    left = A - Q @ (Q.T @ A)
    left -= Q @ (Q.T @ left)
    return np.asarray(left)


def explained(known: Array, columns: Array, y: Array, seen: float) -> tuple[float, int]:
    """Δ, the drop of |y|² (n,) by columns (n, k) beside what is known (n, p), all whitened, and their rank.

    seen: share of the largest direction below which one is nothing
    """
    Q = orthonormal(known, seen)
    left = clear(Q, np.column_stack([y, columns]))
    C = orthonormal(left[:, 1:], seen)
    return float(np.sum((C.T @ left[:, 0]) ** 2)), int(C.shape[1])


def about_means(X: Array, group: NDArray[np.int64]) -> Array:
    """(n, k) columns about the means of their groups, (n,) 0 … g − 1 without a gap."""
    means = np.array([np.bincount(group, c) for c in X.T]).T / np.bincount(group)[:, None]
    return np.asarray(X - means[group])
