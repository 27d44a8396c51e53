"""What columns span, where nobody asks for an orthonormal basis: a third of the work of one.

    q = X W,  W = V S⁻¹ of XᵀX = V S² Vᵀ,   P = q (qᵀq)⁻¹ qᵀ

q is orthonormal to 1e-4, as eigenvectors of a product are; what it leaves out is won back by repetition.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array
from planner.solvers.least_squares import directions

_AGAIN = 3  # 1e-4 each time


@dataclass(frozen=True)
class Span:
    """The column space of X. X: (n, p); way: (p, r) W."""

    X: Array
    way: Array

    @staticmethod
    def of(X: Array, tolerance: float) -> Span:
        """Of columns X (n, p), without directions below that share of the largest."""
        return Span(X, directions(X, tolerance))

    @property
    def rank(self) -> int:
        """r."""
        return int(self.way.shape[1])

    def clear(self, y: Array) -> Array:
        """(n,) (I − P) y."""
        for _ in range(_AGAIN):
            y = y - self.X @ (self.way @ (self.way.T @ (self.X.T @ y)))
        return y

    def energy(self, A: Array) -> float:
        """Σ (A W)², A (m, p) linear images of the columns: what P has of them."""
        return float(np.sum((A @ self.way) ** 2))
