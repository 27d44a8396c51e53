"""Inverses of many normal equations at once, and by how much unknowns inflate each other's variances."""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array

RIDGE = 1e-14  # of M's unit diagonal: a singular one is inverted, and its inflation told from a good one's
UNSEEN = 1e10  # inflation of a variance from which on a coefficient counts as undetermined


def by_coefficients(inflated: Array, M: Array) -> Array:
    """Inflations (a, B, P) by the other coefficients alone, where with the shared unknowns they are large.

    What only a reference keeps from being known is as uncertain as that is; M: (a, B, P, P) of coefficients.
    """
    far = (inflated > UNSEEN).any(axis=(0, 2))
    found = inflated.copy()
    if far.any():
        found[:, far] = np.minimum(found[:, far], inverse(M[:, far])[1])
    return found


def inverse(M: Array) -> tuple[Array, Array]:
    """M⁻¹ and the inflation of each variance by the other unknowns, (..., P, P) and (..., P)."""
    P = M.shape[-1]
    every = range(P)
    diagonal = M[..., every, every]
    scale = 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    unit = M * scale[..., :, None] * scale[..., None, :]
    unit[..., every, every] = np.where(diagonal > 0, 1.0 + RIDGE, RIDGE)
    inverted = np.linalg.inv(unit)
    return inverted * scale[..., :, None] * scale[..., None, :], np.abs(inverted[..., every, every])
