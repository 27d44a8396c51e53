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
from numpy.typing import NDArray

from planner.nouns.array import Array

Indices = NDArray[np.intp]
COMPONENTS = 3
_STANDSTILL = 1e-12  # relative: three digits below the promised 1e-9
_MOST_ANGLES = 2**15
_NEWTON_STEPS = 60
_AT_ONCE = 2**20  # covariances × angles in memory at a time: 8 MB an array


def exceedance(covariance: Array, length: Array, tolerance: float = _STANDSTILL) -> Array:
    """P(‖x‖ > length), relative accuracy 1e-9 at least: covariance (..., k, k), k <= 3, length (...) >= 0."""
    largest, ratios = _normalised(principal_variances(covariance))
    roots = np.asarray(length) / np.sqrt(2.0 * np.where(largest > 0, largest, 1.0))
    root, flat = roots.reshape(-1), ratios.reshape(-1, COMPONENTS - 1)

    def tail(rows: Indices, angles: Array, _: Array) -> Array:
        return _tail_and_density(root[rows], flat[rows], angles)[0]

    found = _refined(tail, np.zeros_like(root), tolerance).reshape(roots.shape)
    return np.where(largest > 0, found, 0.0)


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


def length_per_rms(probability: float, parts: int = 50) -> tuple[float, float]:
    """Bounds on percentile / sqrt(trace of the covariance) over all covariances of three components.

    The percentile grows with every eigenvalue, so eigenvalues rounded up (down) to multiples of 1/parts of
    the trace bound it from above (below); all such triples are tried. Some 4 % wider than the true range.
    """
    first, second, third = np.meshgrid(*[np.arange(parts + COMPONENTS + 1)] * COMPONENTS, indexing="ij")
    total = first + second + third
    tried = (first >= second) & (second >= third) & (np.abs(total - parts) <= COMPONENTS)
    spectra = np.stack([first[tried], second[tried], third[tried]], axis=-1) / parts
    largest, ratios = _normalised(spectra)
    lengths = np.sqrt(2.0 * largest) * _root(ratios, probability, 1e-6)
    rounded_up, rounded_down = total[tried] >= parts, total[tried] <= parts
    return float(lengths[rounded_down].min()), float(lengths[rounded_up].max())


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
    """P(length > r) and its density in √κ: √κ = `root` (n,), ratios (n, 2), the mean over `angles` (m,)."""
    parts = -(-len(root) * len(angles) // _AT_ONCE)
    if parts <= 1:
        return _tail_and_density_part(root, ratios, angles)
    split = zip(np.array_split(root, parts), np.array_split(ratios, parts), strict=True)
    done = [_tail_and_density_part(one, shape, angles) for one, shape in split]
    return np.concatenate([tail for tail, _ in done]), np.concatenate([density for _, density in done])


def _tail_and_density_part(root: Array, ratios: Array, angles: Array) -> tuple[Array, Array]:
    from scipy.special import dawsn, erfc

    share = ratios[:, :1] * np.cos(angles) ** 2 + ratios[:, 1:] * np.sin(angles) ** 2
    share = np.maximum(share, 1e-290)  # s²/λ₁ = 1/(1 + c); zero would make c infinite, the limit is the same
    rest = np.sqrt(np.maximum((1.0 - share) / share, 1e-30))  # √c; zero would make 0/0, the limit is the same
    kernel = dawsn(root[:, None] * rest) / rest
    factor = 2.0 / np.sqrt(np.pi) * np.exp(-(root**2))
    tail = erfc(root) + factor * kernel.mean(axis=-1)
    return tail, factor * (kernel / share).mean(axis=-1) * 2.0 * root


def _angles(count: int) -> Array:
    """Midpoints of `count` intervals of a quarter turn: by symmetry the trapezoid rule of a whole turn."""
    return np.asarray((np.arange(count) + 0.5) * (np.pi / 2.0 / count))


def _refined(value: Callable[[Indices, Array, Array], Array], start: Array, tolerance: float) -> Array:
    """value(rows, angles, what it was) for all rows (n,), with the angles doubled until each stands still."""
    rows, count = np.arange(len(start)), 8
    found = value(rows, _angles(count), start)
    while len(rows) and count < _MOST_ANGLES:
        count *= 2
        after = value(rows, _angles(count), found[rows])
        moving = np.abs(after - found[rows]) > tolerance * np.abs(after)
        found[rows] = after
        rows = rows[moving]
    return found


def _root(ratios: Array, probability: float, tolerance: float) -> Array:
    """√κ (n,) of the percentile for eigenvalue ratios (n, 2)."""
    from scipy.special import erfinv, gammaincinv

    low = float(erfinv(probability))  # λ₂ = λ₃ = 0
    high = float(np.sqrt(gammaincinv(COMPONENTS / 2.0, probability)))  # λ₂ = λ₃ = λ₁

    def root(rows: Indices, angles: Array, before: Array) -> Array:
        return _solve(ratios[rows], probability, angles, before, (low, high), tolerance)

    return _refined(root, low + (high - low) * ratios.mean(axis=-1), tolerance)


def _solve(
    ratios: Array,
    probability: float,
    angles: Array,
    start: Array,
    bracket: tuple[float, float],
    tolerance: float,
) -> Array:
    """Newton on log P(length > r) = log(1 − p) from `start` (n,), kept in the bracket."""
    low, high = (np.full(len(start), end) for end in bracket)
    root, target = start, np.log1p(-probability)
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
