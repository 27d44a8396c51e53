"""Generalised least squares of units whose response bends: the Jacobian is that at each unit's coefficients.

    θ ← θ + (XᵀΩX)⁻¹ XᵀΩ (y − ŷ(θ)),  X = ∂ŷ/∂θ at θ,  Ω = (V + Z Zᵀ)⁻¹

for units that the Jacobian at zero does not bring to rest: where a scale factor is known to a per cent only
and a misalignment lets a part of 1500 deg/s through, θ ← θ + P (y − ŷ(θ)) moves away from the solution.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.verify.weights import Weights

ROUNDS = 12
TOGETHER = 64  # units that are solved together: their slopes are a hundred megabytes at most
RANK = 1e-12  # of the largest eigenvalue of XᵀΩX with columns of unit length: below is rounding

Linearised = Callable[[Array, NDArray[np.int64]], tuple[Array, Array]]
"""Coefficients (B, p) of units -> what their readings leave (B, n), and the response's slope (B, n, p)."""


def gauss_newton(
    start: Array, linearised: Linearised, weights: Weights, enough: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """(B, p) coefficients from start (B, p), and (B,) whether the last step is within enough (p,)."""
    theta, settled = start.copy(), np.zeros(len(start), dtype=bool)
    for some in np.array_split(np.arange(len(start)), max(-(-len(start) // TOGETHER), 1)):
        for _ in range(ROUNDS):
            left, slope = linearised(theta[some], some)
            X = weights.whitened(slope)
            r = weights.whitened(left[..., None])
            length = np.linalg.norm(X, axis=1)
            length = np.where(length > 0.0, length, 1.0)
            X = X / length[:, None]
            XT = np.swapaxes(X, 1, 2)
            if not np.all(np.isfinite(X)):
                break
            step = (np.linalg.pinv(XT @ X, RANK, hermitian=True) @ (XT @ r))[..., 0] / length
            theta[some] += step
            settled[some] = np.all(np.abs(step) <= enough, axis=1)
            if settled[some].all():
                break
    return theta, settled
