"""Length of a zero-mean Gaussian vector of one, two or three components: exact distribution and percentile.

With the eigenvalues λ₁ ≥ λ₂ ≥ λ₃ of the covariance, κ = r²/(2λ₁), s²(φ) = λ₂cos²φ + λ₃sin²φ and
c(φ) = λ₁/s²(φ) − 1, conditioning on the first principal component and on the angle φ of the other two leaves

    P(length > r) = erfc(√κ) + (2/√π) e^(−κ) ⟨ D(√(κc)) / √c ⟩        D: Dawson's integral, ⟨⟩: mean over φ
    density in κ  =           (2/√π) e^(−κ) ⟨ (1 + c) D(√(κc)) / √c ⟩

Every term is positive, so the tail has full relative accuracy; one component has c = ∞ (the normal law),
three equal ones c = 0 (Maxwell's). The mean of a smooth periodic function is taken by the trapezoid rule,
whose error falls faster than any power of the number of angles; it is doubled until it stands still.
Derived for this program; the law is that of a weighted sum of chi-squares (Imhof, Biometrika 48, 1961).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.records import Array

COMPONENTS = 3
_STANDSTILL = 1e-12  # relative: three digits below the promised 1e-9
_MOST_ANGLES = 2**15
_NEWTON_STEPS = 60


def exceedance(covariance: Array, length: Array, tolerance: float = _STANDSTILL) -> Array:
    """P(‖x‖ > length), relative accuracy 1e-9 at least: covariance (..., k, k), k <= 3, length (...) >= 0."""
    largest, ratios = _normalised(principal_variances(covariance))
    root = np.asarray(length) / np.sqrt(2.0 * np.where(largest > 0, largest, 1.0))
    tail = _standing(lambda angles: _tail_and_density(root, ratios, angles)[0], tolerance)
    return np.where(largest > 0, tail, 0.0)


def percentile(covariance: Array, probability: float, tolerance: float = _STANDSTILL) -> Array:
    """The length that ‖x‖ stays below with `probability`: covariance (..., k, k), k <= 3 -> (...).

    Relative accuracy 1e-9 at least (a coarser `tolerance` makes it faster). Any rank is allowed; a zero
    covariance has length 0.
    Raises ValueError for more than three components or a probability outside (0, 1).
    """
    if not 0.0 < probability < 1.0:
        raise ValueError(f"probability {probability} is not between 0 and 1")
    largest, ratios = _normalised(principal_variances(covariance))
    flat = ratios.reshape(-1, COMPONENTS - 1)
    roots = np.sqrt(largest) * np.sqrt(2.0) * _root(flat, probability, tolerance).reshape(largest.shape)
    return np.asarray(roots)


def principal_variances(covariance: Array) -> Array:
    """(..., k, k) covariance -> (..., 3) eigenvalues, largest first, padded with zeros."""
    covariance = np.asarray(covariance, dtype=float)
    missing = COMPONENTS - covariance.shape[-1]
    if missing < 0:
        raise ValueError(f"{covariance.shape[-1]} components; at most {COMPONENTS} are supported")
    values = np.linalg.eigvalsh(covariance)[..., ::-1] if covariance.shape[-1] > 1 else covariance[..., 0]
    padding = np.zeros((*values.shape[:-1], missing))
    padded = np.concatenate([values, padding], axis=-1)
    return np.asarray(np.maximum(padded, 0.0))  # rounding leaves −1e-20 for zero


def _normalised(eigenvalues: Array) -> tuple[Array, Array]:
    """Largest eigenvalue (...) and the two others in its units (..., 2)."""
    ordered = -np.sort(-np.asarray(eigenvalues, dtype=float), axis=-1)
    largest = ordered[..., 0]
    return largest, ordered[..., 1:] / np.where(largest > 0, largest, 1.0)[..., None]


def _tail_and_density(root: Array, ratios: Array, angles: Array) -> tuple[Array, Array]:
    """P(length > r) and its density in √κ, with √κ = `root` (...) and the mean over `angles` (m,)."""
    from scipy.special import dawsn, erfc

    share = ratios[..., 0, None] * np.cos(angles) ** 2 + ratios[..., 1, None] * np.sin(angles) ** 2
    share = np.maximum(share, 1e-290)  # s²/λ₁ = 1/(1 + c); zero would make c infinite, the limit is the same
    rest = np.sqrt(np.maximum((1.0 - share) / share, 1e-30))  # √c; zero would make 0/0, the limit is the same
    kernel = dawsn(root[..., None] * rest) / rest
    factor = 2.0 / np.sqrt(np.pi) * np.exp(-(root**2))
    tail = erfc(root) + factor * kernel.mean(axis=-1)
    return tail, factor * (kernel / share).mean(axis=-1) * 2.0 * root


def _angles(count: int) -> Array:
    """Midpoints of `count` intervals of a quarter turn: by symmetry the trapezoid rule of a whole turn."""
    return np.asarray((np.arange(count) + 0.5) * (np.pi / 2.0 / count))


def _standing(value: Callable[[Array], Array], tolerance: float) -> Array:
    """`value(angles)` with the number of angles doubled until the value stands still."""
    count, before = 8, value(_angles(8))
    while count < _MOST_ANGLES:
        count *= 2
        after = value(_angles(count))
        if np.all(np.abs(after - before) <= tolerance * np.abs(after)):
            return after
        before = after
    return before


def _root(ratios: Array, probability: float, tolerance: float) -> Array:
    """√κ (n,) of the percentile for eigenvalue ratios (n, 2): on a few angles first, then on enough."""
    count, root = 8, _solve(ratios, probability, _angles(8), None, tolerance)
    while count < _MOST_ANGLES:
        count *= 2
        better = _solve(ratios, probability, _angles(count), root, tolerance)
        if np.all(np.abs(better - root) <= tolerance * better):
            return better
        root = better
    return root


def _solve(ratios: Array, probability: float, angles: Array, start: Array | None, tolerance: float) -> Array:
    """Newton on log P(length > r) = log(1 − p), kept in the bracket of one and of three equal components."""
    from scipy.special import erfinv, gammaincinv

    low = np.full(len(ratios), erfinv(probability))  # λ₂ = λ₃ = 0
    high = np.full(len(ratios), np.sqrt(gammaincinv(COMPONENTS / 2.0, probability)))  # λ₂ = λ₃ = λ₁
    root = low + (high - low) * ratios.mean(axis=-1) if start is None else start
    target = np.log1p(-probability)
    for _ in range(_NEWTON_STEPS):
        tail, density = _tail_and_density(root, ratios, angles)
        excess = np.log(tail) - target
        low, high = np.where(excess > 0, root, low), np.where(excess > 0, high, root)
        step = root + excess * tail / density
        after = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
        root, moved = np.asarray(after), np.abs(after - root)
        if np.all(moved <= 0.1 * tolerance * root):
            break
    return root
