"""Best linear unbiased prediction of a curve between measured points (kriging).

    θ(T) = c + f(T),   v = θ(T_k) + e,   E f fᵀ = M,   cov e = C
    w(T) = argmin E (w·v − θ(T))²,   Σ_k w_k = 1

c is any constant: its weights sum to one. Nothing need be Gaussian; second moments decide (Matheron 1963;
Robinson, Statistical Science 6(1), 1991, 15).
"""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array

NUGGET = 1e-9  # of each point's own variance: keeps smooth curves at many points apart


def kriging_weights(known: Array, across: Array) -> Array:
    """(…, X, K) weights w of v, from M + C of the points (…, K, K) and M to what is read (…, K, X)."""
    K = known.shape[-1]
    spread = np.sqrt(np.maximum(known[..., range(K), range(K)], np.finfo(float).tiny))
    unit = known / (spread[..., :, None] * spread[..., None, :])
    unit[..., range(K), range(K)] = 1.0 + NUGGET
    inverse = np.linalg.inv(unit)
    share = spread.min(axis=-1, keepdims=True) / spread  # of a constant in each scaled point
    free = inverse @ (across / spread[..., None])
    flat = (inverse @ share[..., None])[..., 0]
    lack = spread.min(axis=-1)[..., None] - (share[..., None, :] @ free)[..., 0, :]
    scaled = free + flat[..., :, None] * (lack / np.sum(share * flat, axis=-1)[..., None])[..., None, :]
    return np.asarray(np.swapaxes(scaled / spread[..., None], -1, -2))
