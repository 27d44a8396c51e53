"""What columns explain by the directions that they tell well; G = CᵀC, h = Cᵀz of whitened columns C (n, k).

A direction of less than a share of the best told one's information is none: badly told coefficients say
nothing of other channels.
"""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array


def explained(G: Array, h: Array, told: float) -> Array:
    """Δ = hᵀ G⁺ h (…,) of G (…, k, k) and h (…, k); told: share of the best told direction."""
    return np.asarray(np.einsum("...i,...ij,...j->...", h, inverse_of_told(G, told), h))


def inverse_of_told(G: Array, told: float) -> Array:
    """(…, k, k) G⁺."""
    return np.asarray(np.linalg.pinv(G, rcond=told, hermitian=True), dtype=float)


def rank(G: Array, told: float) -> int:
    """How many directions of one G (k, k) are told."""
    values = np.linalg.eigvalsh(G)
    return int(np.count_nonzero(values > told * values[-1])) if values[-1] > 0.0 else 0
