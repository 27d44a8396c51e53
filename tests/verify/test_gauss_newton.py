"""Where the Jacobian at zero does not contract, that of the unit's own coefficients does."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from planner.nouns.array import Array
from planner.verify.gauss_newton import gauss_newton
from planner.verify.weights import Weights

N, RUNS = 12, 3
RNG = np.random.default_rng(14)
TURN, ACROSS = RNG.normal(size=N) * 0.02, np.linspace(-1.0, 1.0, N)
ROOTS = [np.linalg.cholesky(np.eye(4) + 0.5) * s for s in (0.01, 0.02, 0.03)]
ROWS = list(np.arange(N).reshape(RUNS, 4))
SHARED = RNG.normal(size=(N, 2)) * 0.02


def response(theta: Array) -> Array:
    """y = (1 + k)(u + m w) + b, u so small that w tells k and m by their product alone."""
    b, k, m = np.moveaxis(theta, -1, 0)[..., None]
    return (1.0 + k) * (TURN + m * ACROSS) + b


def slope(theta: Array) -> Array:
    _, k, m = np.moveaxis(theta, -1, 0)[..., None]
    own = np.ones_like(m * ACROSS)
    return np.stack([own, TURN + m * ACROSS, (1.0 + k) * ACROSS * own], axis=-1)


def whitened(x: Array) -> Array:
    V = np.zeros((N, N))
    for root, r in zip(ROOTS, ROWS, strict=True):
        V[np.ix_(r, r)] = root @ root.T
    return np.linalg.solve(np.linalg.cholesky(V + SHARED @ SHARED.T), x)


def test_the_least_squares_of_a_response_that_bends() -> None:
    truth = np.column_stack([RNG.normal(size=40) * 0.1, RNG.normal(size=40) * 0.02, RNG.normal(size=40)])
    y = response(truth) + RNG.normal(size=(40, N)) * 1e-3
    white = np.concatenate([np.linalg.solve(root, SHARED[r]) for root, r in zip(ROOTS, ROWS, strict=True)])
    weights = Weights(ROOTS, ROWS, white)

    def linearised(theta: Array, which: Array) -> tuple[Array, Array]:
        return y[which] - response(theta), slope(theta)

    start = np.column_stack([np.zeros((40, 2)), truth[:, 2] + 0.2])
    found, settled = gauss_newton(start, linearised, weights, np.full(3, 1e-9))
    assert settled.all()
    for unit in range(5):
        best = least_squares(
            lambda theta, own=y[unit]: whitened(own - response(theta)), truth[unit], xtol=1e-14, ftol=1e-14
        )
        assert found[unit] == pytest.approx(best.x, abs=1e-6)
