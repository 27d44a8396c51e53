"""Share of zero-mean Gaussian vectors within a length, quickly and for many covariances at once.

With d = Σ^½ ρ u, u a direction and ρ the length of a standard vector of c components,

    P(|d| <= r) = ⟨ F_c(r² / (uᵀ Σ u)) ⟩
    F_1 = erf(√(x/2)),  F_2 = 1 − e^(−x/2),  F_3 = F_1 − √(2x/π) e^(−x/2)

⟨⟩ the mean over directions in the principal axes, by midpoints over the angle and Gauss-Legendre over the
height. Good to 1e-4 and better for a search; `gaussian_length` has the exact law.
"""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array

_ANGLES = 12
_HEIGHTS = 8
_HALVINGS = 18
_TINY = 1e-300


def variances_along(covariance: Array) -> tuple[Array, int]:
    """(..., D) uᵀ Σ u of the directions that `within` averages over, and how many components there are."""
    c = covariance.shape[-1]
    if c == 1:
        return np.maximum(covariance[..., 0], _TINY), 1
    if c == 2:
        return np.maximum(_planar(covariance) @ _circle(), _TINY), 2
    if c == 3:
        return np.maximum(np.linalg.eigvalsh(covariance) @ _sphere(), _TINY), 3
    raise ValueError(f"{c} components; at most three are supported")


def within(along: Array, components: int, length: Array) -> Array:
    """(...) share of the vectors within a length (...), from what `variances_along` gives."""
    from scipy.special import erf

    x = np.asarray(length)[..., None] ** 2 / along
    if components == 1:
        return np.asarray(erf(np.sqrt(0.5 * x)).mean(axis=-1))
    decay = np.exp(-0.5 * x)
    if components == 2:
        return np.asarray(1.0 - decay.mean(axis=-1))
    return np.asarray((erf(np.sqrt(0.5 * x)) - np.sqrt(2.0 / np.pi * x) * decay).mean(axis=-1))


def length_within(along: Array, components: int, share: float, weights: Array | None) -> Array:
    """(...) the length within which `share` of the vectors lie, of mixtures (..., S, D) with weights (S,).

    weights None: of the worst of the S. Bisection in the logarithm, to 3e-5.
    """
    largest = along.max(axis=(-1, -2))
    low, high = np.log(0.02 * np.sqrt(largest)), np.log(6.0 * np.sqrt(largest))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        each = within(along, components, np.exp(middle)[..., None])
        found = each.min(axis=-1) if weights is None else each @ weights
        low, high = np.where(found < share, middle, low), np.where(found < share, high, middle)
    return np.asarray(np.exp(high))


def _planar(covariance: Array) -> Array:
    """(..., 2) eigenvalues of 2 × 2 matrices."""
    a, b, c = covariance[..., 0, 0], covariance[..., 0, 1], covariance[..., 1, 1]
    mean, half = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    return np.stack([mean + half, mean - half], axis=-1)


def _circle() -> Array:
    """(2, D) squares of direction cosines."""
    angle = (np.arange(_ANGLES) + 0.5) * (0.5 * np.pi / _ANGLES)
    return np.stack([np.cos(angle) ** 2, np.sin(angle) ** 2])


def _sphere() -> Array:
    """(3, D) squares of direction cosines; heights of equal weight, so that the mean is the plain one."""
    height = (np.arange(_HEIGHTS) + 0.5) / _HEIGHTS
    angle = (np.arange(_ANGLES) + 0.5) * (0.5 * np.pi / _ANGLES)
    h, a = (x.ravel() for x in np.meshgrid(height, angle, indexing="ij"))
    return np.stack([(1.0 - h**2) * np.cos(a) ** 2, (1.0 - h**2) * np.sin(a) ** 2, h**2])
