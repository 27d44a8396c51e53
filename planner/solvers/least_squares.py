"""Linear least squares by orthogonal factors: the null space named, two refinements.

Columns are scaled to unit length first, so that rank and condition number say what the data can tell apart
and not in which units the coefficients stand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# singular values of the scaled columns below this share of the largest are rounding: 1e5 ulps of a double
RANK_TOLERANCE = 1e-11
_SAFE = 1e-100, 1e100  # lengths, between which no square has over- or underflown
_TALL = 3000  # rows from which two products of matrices are cheaper than reflections
_TAME = 1e-5  # smallest over largest pivot of Cholesky's factor
_SQUARED = 1e-6  # rank tolerance whose square a product XᵀX still tells from rounding
_MANY = 400  # rows, from which that product and its eigenvectors take less than half the time of reflections
_REFINED = 200_000  # elements of X up to which refinement in long double takes no noticeable time


@dataclass(frozen=True)
class Factors:
    """X diag(scale)⁻¹ = basis · V Σ-part: an orthonormal basis of X's column space and the way back.

    basis: (n, r) orthonormal; to_coefficients: (p, r), coefficients = to_coefficients · (basisᵀ y)
    null_space: (p, p − r) orthonormal directions, in scaled coefficients, that X does not see
    scale: (p,) lengths of the columns, 1 where a column is zero
    condition: largest over smallest singular value of the scaled columns that X sees
    """

    basis: Array
    to_coefficients: Array
    null_space: Array
    scale: Array
    condition: float

    @property
    def rank(self) -> int:
        """How many combinations of the coefficients are determined."""
        return int(self.basis.shape[1])

    def solve(self, y: Array) -> Array:
        """Coefficients (p,) that minimise |y − X β|, y (n,), of least scaled length where undetermined."""
        return np.asarray(self.to_coefficients @ (self.basis.T @ y))

    def undetermined(self, tolerance: float = 1e-6) -> NDArray[np.bool_]:
        """(p,) which coefficients take part in a combination that X does not see."""
        if self.null_space.shape[1] == 0:
            return np.zeros(len(self.scale), dtype=bool)
        return np.asarray(np.sqrt(np.sum(self.null_space**2, axis=1)) > tolerance)


def factors(X: Array, tolerance: float = RANK_TOLERANCE) -> Factors:
    """Orthogonal factors of X (n, p): Householder QR of the scaled columns, then the SVD of the small R.

    Where the tolerance is no finer than XᵀX can tell, the eigenvectors of that, a third of the work.
    Raises ValueError when X or a column is not finite.
    """
    length = _lengths(X)
    if not np.isfinite(length).all():
        raise ValueError("the design has NaN or infinite entries")
    scale = np.where(length > 0, length, 1.0)
    if tolerance >= _SQUARED and len(X) >= max(_MANY, 4 * X.shape[1]) and X.shape[1]:
        return _squared(X / scale, scale, tolerance)
    q, r = _orthogonal(X / scale)
    u, s, vt = np.linalg.svd(r)
    rank = int(np.sum(s > tolerance * s[0])) if len(s) and s[0] > 0 else 0
    return Factors(
        basis=q @ u[:, :rank],
        to_coefficients=(vt[:rank].T / s[:rank]) / scale[:, np.newaxis],
        null_space=vt[rank:].T,
        scale=scale,
        condition=float(s[0] / s[rank - 1]) if rank else np.inf,
    )


def _squared(X: Array, scale: Array, tolerance: float) -> Factors:
    """The same by XᵀX = V S² Vᵀ: X V S⁻¹ is orthonormal to 1e-4, and by Cholesky's factor to rounding."""
    square, vectors = np.linalg.eigh(X.T @ X)
    square, vectors = square[::-1], vectors[:, ::-1]
    rank = int(np.sum(square > tolerance**2 * square[0])) if square[0] > 0 else 0
    way = vectors[:, :rank] / np.sqrt(square[:rank])
    q = X @ way
    turned = np.linalg.inv(np.linalg.cholesky(q.T @ q)).T
    return Factors(
        basis=q @ turned,
        to_coefficients=(way @ turned) / scale[:, np.newaxis],
        null_space=vectors[:, rank:],
        scale=scale,
        condition=float(np.sqrt(square[0] / square[rank - 1])) if rank else np.inf,
    )


def _lengths(X: Array) -> Array:
    """(p,) lengths of the columns; squares do not overflow, for powers of two change no digit.

    A column whose squares vanish has no length: what divides by it would overflow.
    """
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        length = np.sqrt(np.einsum("np,np->p", X, X))
    odd = ~((length > _SAFE[0]) & (length < _SAFE[1]))
    if odd.any():
        rest = X[:, odd]
        exponent = np.maximum(np.frexp(np.abs(rest).max(axis=0, initial=0.0))[1], 0)
        length[odd] = np.ldexp(np.sqrt(np.sum(np.ldexp(rest, -exponent) ** 2, axis=0)), exponent)
    return np.asarray(length)


def _orthogonal(X: Array) -> tuple[Array, Array]:
    """Q, R of X with columns of unit length: Householder, or where X is tall and tame Cholesky twice.

    The second pass makes Q orthonormal to rounding while the condition is below 1e8 (Yamamoto et al., ETNA
    44, 2015, 306); it costs two products of matrices.
    """
    if len(X) < max(_TALL, 20 * X.shape[1]) or X.shape[1] == 0:
        return np.linalg.qr(X)
    try:
        first = np.linalg.cholesky(X.T @ X).T
        size = np.abs(np.diag(first))
        if size.min() < _TAME * size.max():
            return np.linalg.qr(X)
        q = X @ np.linalg.inv(first)
        second = np.linalg.cholesky(q.T @ q).T
    except np.linalg.LinAlgError:
        return np.linalg.qr(X)
    return q @ np.linalg.inv(second), second @ first


def least_squares(X: Array, y: Array, tolerance: float = RANK_TOLERANCE) -> tuple[Array, Factors]:
    """Coefficients (p,) that minimise |y − X β|, of least scaled length where X does not determine them.

    y: (n,). Two steps of iterative refinement with residuals in long double (Björck 1967) win back the
    digits that a condition number of 1e9 would cost. Returns the factors with the coefficients.
    """
    found = factors(X, tolerance)
    beta = found.solve(y)
    if X.size <= _REFINED:
        wide = X.astype(np.longdouble)
        for _ in range(2):
            residual = np.asarray(y - wide @ beta.astype(np.longdouble), dtype=float)
            beta = beta + found.solve(residual)
    return beta, found
