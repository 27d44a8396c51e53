"""Orthogonal factors of tall designs by a product of matrices: those by reflections."""

from __future__ import annotations

import numpy as np
import pytest

from planner.solvers.least_squares import factors


@pytest.mark.parametrize("apart", [1e-1, 1e-3, 1e-4, 1e-7])
def test_tall_factors_by_the_product_are_those_by_reflections(apart: float) -> None:
    """A fourth column that is the sum of two others but for `apart` of its length; rank told to 1e-5."""
    rng = np.random.default_rng(2)
    X = rng.normal(size=(4000, 3)) * np.array([1e-6, 1.0, 1e5])
    unit = X / np.linalg.norm(X, axis=0)
    noise = rng.normal(size=4000)
    X = np.column_stack([X, unit[:, 0] + unit[:, 1] + apart * noise / np.linalg.norm(noise)])
    fast, slow = factors(X, 1e-5), factors(X, 9e-7)  # finer than products tell: reflections
    assert fast.rank == slow.rank == (4 if apart > 1e-5 else 3)
    y = rng.normal(size=4000)
    np.testing.assert_allclose(fast.basis.T @ fast.basis, np.eye(fast.rank), atol=1e-13)
    np.testing.assert_allclose(fast.basis @ (fast.basis.T @ y), slow.basis @ (slow.basis.T @ y), atol=1e-9)
    fitted = X @ fast.solve(y)
    np.testing.assert_allclose(fitted, slow.basis @ (slow.basis.T @ y), atol=1e-9)
    assert fast.condition == pytest.approx(slow.condition, rel=1e-3)
