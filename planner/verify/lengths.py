"""How long a Gaussian vector is: exact probabilities and quantiles, of one covariance and of a mixture.

Σ λ z² by conditioning: polar in two directions, P(λ₁z₁² + λ₂z₂² > y) = mean over θ of
exp(−y / 2(λ₁cos² + λ₂sin²)); the third is integrated out by Gauss-Legendre. Checked against Imhof's inversion
(Biometrika 48, 1961).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from planner.nouns.array import Array

_LEAST = 1e-12  # of the largest variance: a direction of less adds nothing
_ANGLES = 128  # periodic and smooth: 1e-13 of the length for variances from 1 : 1 to 1 : 1e-6


def length_quantile(covariance: Array, probability: float) -> float:
    """r with P(|x| < r) = p for a Gaussian x of covariance (k, k), k up to three."""
    return mixed_quantile([covariance], [1.0], probability)


def mixed_quantile(covariances: Sequence[Array], shares: Sequence[float], probability: float) -> float:
    """r with Σ share · P(|x| < r) = p, x Gaussian of each covariance (k, k) in its share of the cases."""
    from scipy.optimize import brentq

    every = [_variances(one) for one in covariances]
    scale = max((float(v.sum()) for v in every), default=0.0)
    if scale == 0.0:
        return 0.0
    mixed = [(v / scale, share) for v, share in zip(every, shares, strict=True)]

    def short(x: float) -> float:
        return sum(share * beyond(v, x) for v, share in mixed) - (1.0 - probability)

    least = 1e-9
    if short(least) <= 0.0:  # so large a share of the cases has no error at all
        return 0.0
    return float(np.sqrt(scale * brentq(short, least, 60.0, xtol=1e-12, rtol=1e-13)))


def _variances(covariance: Array) -> Array:
    values = np.linalg.eigvalsh(covariance)
    return np.asarray(values[values > _LEAST * values.max(initial=0.0)])


def beyond(variances: Array, x: float) -> float:
    """P(Σ λ z² > x) of up to three λ."""
    from scipy.special import erfc

    if len(variances) == 0:
        return 0.0
    largest = np.sort(variances)[::-1]
    if len(largest) == 1:
        return float(erfc(np.sqrt(x / (2.0 * largest[0]))))
    if len(largest) == 2:
        return float(_of_two(largest, np.array([x]))[0])
    node, weight = _rule()
    most = min(np.sqrt(x / largest[2]), 12.0)
    z = 0.5 * most * (node + 1.0)
    density = np.exp(-(z**2) / 2.0) / np.sqrt(2.0 * np.pi)
    inside = float(np.sum(weight * density * _of_two(largest, x - largest[2] * z**2)) * most)  # both signs
    return inside + float(erfc(most / np.sqrt(2.0)))


@cache
def _rule() -> tuple[Array, Array]:
    """(96,) nodes and weights of Gauss-Legendre, which take longer than the integral."""
    return np.polynomial.legendre.leggauss(96)


def _of_two(variances: Array, y: Array) -> Array:
    """(m,) P(λ₁z₁² + λ₂z₂² > y)."""
    angle = (np.arange(_ANGLES) + 0.5) * (np.pi / 2.0) / _ANGLES
    width = variances[0] * np.cos(angle) ** 2 + variances[1] * np.sin(angle) ** 2
    return np.asarray(np.exp(-np.maximum(y, 0.0)[:, None] / (2.0 * width)).mean(axis=1))
