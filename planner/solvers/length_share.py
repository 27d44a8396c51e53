"""Share of zero-mean Gaussian vectors within a length, quickly and for many covariances at once.

With d = Σ^½ ρ u, u a direction and ρ the length of a standard vector of c components,

    P(|d| <= r) = ⟨ F_c(r² / (uᵀ Σ u)) ⟩
    F_1 = erf(√(x/2)),  F_2 = 1 − e^(−x/2),  F_3 = F_1 − √(2x/π) e^(−x/2)

⟨⟩ the mean over directions in the principal axes, by midpoints over the angle and Gauss-Legendre over the
height along the largest one. For a search: the length of 80 % of the vectors or more is good to 2e-4, that of
half of them to 2e-3; of fewer it is worse. The share within a length of flights of very different sizes
together is good to 2e-3. `gaussian_length` has the exact law.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from planner.nouns.array import Array

_ANGLES = 12  # of the circle
_AROUND = 5  # of the sphere: the heights decide there, and twice as many angles change nothing
_HEIGHTS = 8
_STEPS = 40
_SETTLED = 1e-4  # of the logarithm: Newton then squares it
_TINY = 1e-300
_BEYOND = 1.03  # the directions that are looked along miss the largest axis by so much at most


def variances_along(covariance: Array) -> tuple[Array, int]:
    """(..., D) uᵀ Σ u of the directions that `within` averages over, and how many components there are."""
    c = covariance.shape[-1]
    if c == 1:
        return np.maximum(covariance[..., 0], _TINY), 1
    if c == 2:
        return np.maximum(_planar(covariance) @ _circle(), _TINY), 2
    if c == 3:
        return np.maximum(_spatial(covariance) @ _sphere(), _TINY), 3
    raise ValueError(f"{c} components; at most three are supported")


def within(along: Array, components: int, length: Array) -> Array:
    """(...) share of the vectors within a length (...), from what `variances_along` gives."""
    from scipy.special import erf

    x = np.asarray(length)[..., None] ** 2 / along
    if components == 2:
        return np.asarray(1.0 - np.exp(-0.5 * x).mean(axis=-1))
    inside = erf(np.sqrt(0.5 * x))
    if components == 1:
        return np.asarray(inside[..., 0])
    return np.asarray((inside - np.sqrt(2.0 / np.pi * x) * np.exp(-0.5 * x)) @ _heights()[1])


def share_by_moments(covariance: Array, length: float) -> Array:
    """(...) share of vectors of covariance (..., c, c) within a length, roughly: what is far off is seen.

    As if |d|² followed the χ² law of its mean and variance (Wilson and Hilferty, PNAS 17, 1931):

        P ≈ Φ(((r²/m)^⅓ − 1 + 2/9ν) / √(2/9ν)),   m = tr Σ,  ν = m² / tr Σ²

    The length of 80 to 99.9 % of the vectors is met to 5 %.
    """
    from scipy.special import ndtr

    m = np.maximum(np.trace(covariance, axis1=-2, axis2=-1), _TINY)
    spread = 2.0 * np.sum(covariance**2, axis=(-2, -1)) / (9.0 * m**2)
    return np.asarray(ndtr((np.cbrt(length**2 / m) - 1.0 + spread) / np.sqrt(np.maximum(spread, _TINY))))


def _share_and_slope(along: Array, components: int, length: Array) -> tuple[Array, Array]:
    """(...) the share within a length (...), and its derivative by the logarithm of the length.

    F_1' = e^(−x/2)/√(2πx),  F_2' = e^(−x/2)/2,  F_3' = √(x/2π) e^(−x/2);  dF/d ln r = 2x F'
    """
    from scipy.special import erf

    x = np.asarray(length)[..., None] ** 2 / along
    decay = np.exp(-0.5 * x)
    if components == 2:
        return np.asarray(1.0 - decay.mean(axis=-1)), np.asarray((x * decay).mean(axis=-1))
    root = np.sqrt(x)
    inside, weights = erf(np.sqrt(0.5) * root), np.ones(1) if components == 1 else _heights()[1]
    slope = np.sqrt(2.0 / np.pi) * root * decay
    if components == 1:
        return np.asarray(inside @ weights), np.asarray(slope @ weights)
    return np.asarray((inside - slope) @ weights), np.asarray((slope * x) @ weights)


def length_within(along: Array, components: int, share: float, weights: Array | None) -> Array:
    """(...) the length within which `share` of the vectors lie, of mixtures (..., S, D) with weights (S,).

    weights None: of the worst of the S. Newton in the logarithm, kept between what is known too small and too
    large, from the length of the χ² law of the same mean and variance of |d|² (Wilson and Hilferty 1931).
    """
    from scipy.special import gammaincinv, ndtri

    if weights is None:  # each for itself
        return np.asarray(length_within(along[..., None, :], components, share, np.ones(1)).max(axis=-1))
    # a vector is longer than its component along the largest axis, shorter than one as wide in all directions
    each_largest = along.max(axis=-1)
    least, most = ndtri(0.5 + 0.5 * share), _BEYOND * np.sqrt(2.0 * gammaincinv(1.5, share))
    low = np.log(least * np.sqrt(each_largest.min(axis=-1)))
    high = np.log(most * np.sqrt(each_largest.max(axis=-1)))
    guess = np.clip(_alike(along, components, share, weights), low, high)
    flat = [np.broadcast_to(x, guess.shape).reshape(-1).copy() for x in (low, high, guess)]
    _settle(along.reshape(guess.size, *along.shape[-2:]), components, share, weights, *flat)
    guess = flat[2].reshape(guess.shape)
    return np.asarray(np.exp(guess))


def _settle(
    along: Array, components: int, share: float, weights: Array, low: Array, high: Array, guess: Array
) -> None:
    """Newton on guesses (n,), in place, each until it is settled; along: (n, S, D)."""
    left = np.arange(len(guess))
    for _ in range(_STEPS):
        at = guess[left]
        each, slope = _share_and_slope(along[left], components, np.exp(at)[:, None])
        beyond = each @ weights - share
        low[left], high[left] = np.where(beyond < 0, at, low[left]), np.where(beyond < 0, high[left], at)
        step = at - beyond / np.maximum(slope @ weights, _TINY)
        inside = (step >= low[left]) & (step <= high[left])  # one that is settled steps onto its own bound
        guess[left] = np.where(inside, step, 0.5 * (low[left] + high[left]))
        left = left[~(np.abs(guess[left] - at) < _SETTLED)]
        if not len(left):
            break


def _alike(along: Array, components: int, share: float, weights: Array) -> Array:
    """(...) logarithm of the length of the χ² law with the mean and the variance of |d|² of the mixture."""
    from scipy.special import ndtri

    c, over = components, np.full(along.shape[-1], 1.0 / along.shape[-1])
    if components == 3:
        over = _heights()[1]
    mean = c * (along @ over) @ weights
    variance = c * (c + 2) * (along**2 @ over) @ weights - mean**2
    small = 2.0 / 9.0 * variance / (2.0 * mean**2)
    cube = np.maximum(1.0 - small + ndtri(share) * np.sqrt(small), 0.1)
    return np.asarray(0.5 * np.log(mean * cube**3))


def _planar(covariance: Array) -> Array:
    """(..., 2) eigenvalues of 2 × 2 matrices."""
    a, b, c = covariance[..., 0, 0], covariance[..., 0, 1], covariance[..., 1, 1]
    mean, half = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    return np.stack([mean + half, mean - half], axis=-1)


def _spatial(covariance: Array) -> Array:
    """(..., 3) eigenvalues of 3 × 3 matrices, ascending: Smith, Communications of the ACM 4 (1961), 168.

    λ = m + 2 p cos(φ + 2πk/3),   m = tr Σ / 3,   6 p² = |Σ − m I|²,   cos 3φ = det((Σ − m I)/p) / 2

    To 1e-8 of the largest, in a tenth of the time that small matrices take one by one.
    """
    A = np.moveaxis(covariance, (-2, -1), (0, 1))
    mean = (A[0, 0] + A[1, 1] + A[2, 2]) / 3.0
    a, b, c = A[0, 0] - mean, A[1, 1] - mean, A[2, 2] - mean
    d, e, f = A[0, 1], A[1, 2], A[0, 2]
    size = np.sqrt((a**2 + b**2 + c**2 + 2.0 * (d**2 + e**2 + f**2)) / 6.0)
    half = 0.5 * (a * (b * c - e**2) - d * (d * c - e * f) + f * (d * e - b * f))
    angle = np.arccos(np.clip(half / np.maximum(size**3, _TINY), -1.0, 1.0)) / 3.0
    largest, least = (mean + 2.0 * size * np.cos(angle + turn) for turn in (0.0, 2.0 * np.pi / 3.0))
    return np.stack([least, 3.0 * mean - least - largest, largest], axis=-1)


def _circle() -> Array:
    """(2, D) squares of direction cosines."""
    angle = (np.arange(_ANGLES) + 0.5) * (0.5 * np.pi / _ANGLES)
    return np.stack([np.cos(angle) ** 2, np.sin(angle) ** 2])


def _sphere() -> Array:
    """(3, D) squares of direction cosines, of the smallest eigenvalue first."""
    h = _heights()[0]
    angle = np.tile((np.arange(_AROUND) + 0.5) * (0.5 * np.pi / _AROUND), _HEIGHTS)
    return np.stack([(1.0 - h**2) * np.cos(angle) ** 2, (1.0 - h**2) * np.sin(angle) ** 2, h**2])


@cache
def _heights() -> tuple[Array, Array]:
    """(D,) heights of the directions on the sphere, from 0 to 1, and their weights."""
    x, weight = np.polynomial.legendre.leggauss(_HEIGHTS)
    return np.repeat(0.5 + 0.5 * x, _AROUND), np.repeat(0.5 * weight / _AROUND, _AROUND)
