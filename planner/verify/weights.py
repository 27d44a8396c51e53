"""What records weigh in a fit: Ω = (V + Z Zᵀ)⁻¹, V block by power-on, Z of what they share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array


@dataclass(frozen=True)
class Weights:
    """Ω of records. roots: Cholesky factor of V of every power-on, in rows; shared: (n, q) L⁻¹ Z"""

    roots: Sequence[Array]
    rows: Sequence[NDArray[np.int64]]
    shared: Array

    def whitened(self, x: Array) -> Array:
        """(B, n, m) -> Ω^½ x."""
        white = np.empty_like(x)
        for root, r in zip(self.roots, self.rows, strict=True):
            white[:, r] = np.linalg.solve(root, x[:, r])
        if self.shared.shape[1] == 0:
            return white
        u, s, _ = np.linalg.svd(self.shared, full_matrices=False)
        return white - u @ ((1.0 - 1.0 / np.sqrt(1.0 + s**2))[:, None] * (u.T @ white))
