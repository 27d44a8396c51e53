"""Boundaries of a test that may stop after every look, exact for Gaussian estimates.

The estimate after k of N equal parts has z_k = S_k/√k, S_k a sum of k standard normals. With boundaries

    b_k = c (k/N)^(Δ − 1/2),    Δ = 1/4 (Wang, Tsiatis, Biometrics 43, 1987, 193)

c is such that P(z_k >= b_k for any k <= N) is the rate: the density of S_k among the ways that have not
stopped is carried from look to look on a grid (Armitage, McPherson, Rowe, J. R. Stat. Soc. A 132, 1969, 235).
"""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array

DELTA = 0.25
_POINTS = 201
_LOWEST = -6.0  # sigmas of the last sum: further down nobody crosses any more
_STEPS = 26  # of the bisection


def boundaries(rate: float, looks: int) -> Array:
    """(N,) normal quantiles at which each of so many looks decides, so that all together err at the rate."""
    shape = (np.arange(1, looks + 1) / looks) ** (DELTA - 0.5)
    low, high = 0.0, 8.0
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if crossed(middle * shape) > rate else (low, middle)
    return np.asarray(high * shape)


def crossed(bounds: Array, drift: float = 0.0) -> float:
    """P(z_k >= bounds_k for any k), each part of the data moving the sum by `drift` on average."""
    return float(1.0 - stopped(bounds, drift)[-1])


def stopped(bounds: Array, drift: float = 0.0) -> Array:
    """(N,) probability that no look up to each has crossed."""
    looks = len(bounds)
    top = bounds * np.sqrt(np.arange(1, looks + 1))
    left = np.empty(looks)
    density, at = None, np.zeros(1)
    for k in range(looks):
        low = min(drift * (k + 1), 0.0) + _LOWEST * np.sqrt(k + 1.0)
        grid = np.linspace(low, top[k], _POINTS)
        if density is None:
            new = _normal(grid - drift)
        else:
            new = _normal(grid[:, None] - at[None, :] - drift) @ (density * _weights(at))
        density, at = new, grid
        left[k] = float(density @ _weights(at))
    return left


def _normal(x: Array) -> Array:
    return np.asarray(np.exp(-0.5 * x**2) / np.sqrt(2 * np.pi))


def _weights(x: Array) -> Array:
    """Simpson's rule on an odd number of even points."""
    w = np.ones(len(x))
    w[1:-1:2], w[2:-1:2] = 4.0, 2.0
    return np.asarray(w * (x[1] - x[0]) / 3.0)
