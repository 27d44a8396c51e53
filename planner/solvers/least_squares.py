"""Linear least squares by orthogonal factors: the null space named, two refinements.

Columns are scaled to unit length first, so that rank and condition number say what the data can tell apart
and not in which units the coefficients stand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.solvers.triangles import inverse_of_triangle, times_transposed

Array = NDArray[np.float64]

# singular values of the scaled columns below this share of the largest are rounding: 1e5 ulps of a double
RANK_TOLERANCE = 1e-11
_SAFE = 1e-100, 1e100  # lengths, between which no square has over- or underflown
_LARGE = 8_000  # elements, from which products of matrices take less time than reflections, down to half
_TALL = 4  # times as many rows as columns: below it they do not
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


def factors(X: Array, tolerance: float = RANK_TOLERANCE, roughly: bool = False) -> Factors:
    """Orthogonal factors of X (n, p): Householder QR of the scaled columns, then the SVD of the small R.

    Where the tolerance is no finer than XᵀX can tell, the eigenvectors of that, a third of the work.
    roughly: a basis that is orthonormal to 1e-4 will do, at half of that; who projects does it twice
    Raises ValueError when X or a column is not finite.
    """
    scale = _scales(X)
    if _told_by_product(X, tolerance):
        return _squared(X / scale, scale, tolerance, roughly)
    q, r = orthogonal(X / scale)
    u, s, vt = np.linalg.svd(r)
    rank = int(np.sum(s > tolerance * s[0])) if len(s) and s[0] > 0 else 0
    return Factors(
        basis=q @ u[:, :rank],
        to_coefficients=(vt[:rank].T / s[:rank]) / scale[:, np.newaxis],
        null_space=vt[rank:].T,
        scale=scale,
        condition=float(s[0] / s[rank - 1]) if rank else np.inf,
    )


def directions(X: Array, tolerance: float = RANK_TOLERANCE) -> Array:
    """W (p, r), X W orthonormal to 1e-4: `Factors.to_coefficients` at a third of the work where X is tall."""
    if not _told_by_product(X, tolerance):
        return factors(X, tolerance).to_coefficients
    scale = _scales(X)
    scaled = X / scale
    vectors, root, rank = _eigen(scaled.T @ scaled, tolerance)
    return (vectors[:, :rank] / root[:rank]) / scale[:, np.newaxis]


def _scales(X: Array) -> Array:
    """(p,) lengths of the columns, 1 where one is zero. Raises ValueError when one is not finite."""
    length = _lengths(X)
    if not np.isfinite(length).all():
        raise ValueError("the design has NaN or infinite entries")
    return np.where(length > 0, length, 1.0)


def _told_by_product(X: Array, tolerance: float) -> bool:
    """Whether XᵀX tells what the tolerance asks, and takes less than half the time."""
    return tolerance >= _SQUARED and len(X) >= max(_MANY, 2 * X.shape[1]) and X.shape[1] > 0


def _eigen(product: Array, tolerance: float) -> tuple[Array, Array, int]:
    """V (p, p), S (p,) of XᵀX = V S² Vᵀ, the largest first, and how many are above the tolerance."""
    square, vectors = np.linalg.eigh(product)
    square, vectors = square[::-1], vectors[:, ::-1]
    rank = int(np.sum(square > tolerance**2 * square[0])) if square[0] > 0 else 0
    return vectors, np.sqrt(np.maximum(square, 0.0)), rank


def _squared(X: Array, scale: Array, tolerance: float, roughly: bool) -> Factors:
    """The same by XᵀX = V S² Vᵀ: X V S⁻¹ is orthonormal to 1e-4, and by Cholesky's factor to rounding."""
    vectors, root, rank = _eigen(X.T @ X, tolerance)
    way = vectors[:, :rank] / root[:rank]
    q = X @ way
    if not roughly:
        turn = inverse_of_triangle(np.linalg.cholesky(q.T @ q))
        q, way = times_transposed(q, turn), times_transposed(way, turn)
    return Factors(
        basis=q,
        to_coefficients=way / scale[:, np.newaxis],
        null_space=vectors[:, rank:],
        scale=scale,
        condition=float(root[0] / root[rank - 1]) if rank else np.inf,
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


def orthogonal(X: Array) -> tuple[Array, Array]:
    """Q, R of X with columns of unit length: Householder, or where X is tall and tame Cholesky twice.

    The second pass makes Q orthonormal to rounding while the condition is below 1e8 (Yamamoto et al., ETNA
    44, 2015, 306); it costs two products of matrices.
    """
    if X.size < _LARGE or len(X) < _TALL * X.shape[1]:
        return np.linalg.qr(X)
    try:
        first = np.linalg.cholesky(X.T @ X)
        size = np.abs(np.diag(first))
        if size.min() < _TAME * size.max():
            return np.linalg.qr(X)
        q = times_transposed(X, inverse_of_triangle(first))
        second = np.linalg.cholesky(q.T @ q)
    except np.linalg.LinAlgError:
        return np.linalg.qr(X)
    return times_transposed(q, inverse_of_triangle(second)), (first @ second).T


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
