"""Generalised least squares with random effects: y = X β + e, cov(e) = V(θ) with θ by REML.

Sources: Kenward, Roger, Biometrics 53 (1997) 983 (covariance and degrees of freedom for few groups);
Satterthwaite, Biometrics Bull. 2 (1946) 110.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.block_covariance import BlockCovariance
from planner.solvers.least_squares import Factors, factors
from planner.solvers.random_effects import Covariance, RandomEffects, covariance
from planner.solvers.reml import Variances

MANY_GROUPS = 1000  # Kenward and Roger add of the order of one over the groups to a covariance


@dataclass(frozen=True)
class MixedFit:
    """β with what is known of it.

    coefficients: (p,); covariance: (p, p), adjusted for the estimated variances (Kenward-Roger)
    freedom: (p,) Satterthwaite degrees of freedom; undetermined: (p,) takes part in a null combination
    factors: of the whitened X; whitened: (n,) residuals that should be white with unit variance
    """

    coefficients: Array
    covariance: Array
    freedom: Array
    undetermined: NDArray[np.bool_]
    factors: Factors
    variances: Variances
    whitened: Array


def mixed_fit(y: Array, X: Array, effects: RandomEffects, variances: Variances) -> MixedFit:
    """Generalised least squares of y (n,) on X (n, p) with V(θ) given, and honest intervals.

    Φ_A = Φ + 2 Φ [Σ W_kl (Q_kl − A_k Φ A_l)] Φ,   ν_j = 2 Φ_jj² / (gᵀWg),  g_k = (Φ A_k Φ)_jj
    with W = cov(θ), A_k = XᵀV⁻¹V_kV⁻¹X, Q_kl = XᵀV⁻¹V_kV⁻¹V_lV⁻¹X.
    """
    v = covariance(effects, variances.theta)
    white = v.whiten(np.column_stack([X, y]))
    found = factors(white[:, :-1])
    beta = found.solve(white[:, -1])
    residual = white[:, -1] - white[:, :-1] @ beta
    beta = beta + found.solve(residual)  # one refinement
    adjusted, freedom = _small_sample(v, v.solve(X @ found.to_coefficients), variances, found.to_coefficients)
    return MixedFit(
        beta, adjusted, freedom, found.undetermined(), found, variances, white[:, -1] - white[:, :-1] @ beta
    )


def _small_sample(
    v: Covariance | BlockCovariance, B: Array, variances: Variances, T: Array
) -> tuple[Array, Array]:
    """Covariance (p, p) and degrees of freedom (p,); in the basis T, with B = V⁻¹XT, Φ is the identity."""
    W = variances.error
    images = np.array([v.effects.times(k, B) for k in range(v.effects.count)])
    A = B.T @ images
    plain = T @ T.T
    adjusted = plain
    if len(v.effects.starts) < MANY_GROUPS:
        adjusted = plain + 2.0 * T @ _bracket(v, W, A, images) @ T.T
    g = np.sum((T @ A) * T, axis=2)
    spread = np.einsum("kp,km,mp->p", g, W, g)
    with np.errstate(divide="ignore", invalid="ignore"):
        freedom = np.where(spread > 0, 2.0 * np.diag(plain) ** 2 / spread, np.inf)
    return adjusted, freedom


def _bracket(v: Covariance | BlockCovariance, W: Array, A: Array, images: Array) -> Array:
    """Σ W_kl (Q_kl − A_k A_l), Q_kl = BᵀV_kV⁻¹V_lB (Kenward, Roger); A (K, r, r); images (K, n, r): V_k B."""
    out = np.zeros_like(A[0])
    for m in np.flatnonzero(W.any(axis=0)).tolist():
        mixed = np.tensordot(W[:, m], images, axes=1)
        out += mixed.T @ v.solve(images[m]) - np.tensordot(W[:, m], A, axes=1) @ A[m]
    return np.asarray((out + out.T) / 2.0)
