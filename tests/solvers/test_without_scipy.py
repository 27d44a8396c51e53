"""Two solvers of our own in place of SciPy's, which are slow to import: the same answers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import nnls

from planner.solvers.cubic_spline import cubic_spline
from planner.solvers.least_squares import factors
from planner.solvers.nonnegative import nonnegative_least_squares


@pytest.mark.parametrize("count", [4, 5, 9, 14])
def test_the_spline_and_its_slope_are_scipys_inside_and_beyond_the_nodes(count: int) -> None:
    rng = np.random.default_rng(count)
    nodes, values, x = np.sort(rng.uniform(-60, 60, count)), rng.normal(size=count), rng.uniform(-70, 70, 200)
    mine, theirs = cubic_spline(nodes, values), CubicSpline(nodes, values)
    np.testing.assert_allclose(mine(x), theirs(x), rtol=0, atol=1e-12 * np.abs(theirs(x)).max())
    slope = theirs(x, 1)
    np.testing.assert_allclose(mine.derivative(x), slope, rtol=0, atol=1e-12 * np.abs(slope).max())


def test_a_cubic_is_its_own_spline() -> None:
    nodes, x = np.array([-3.0, -1.0, 0.5, 2.0, 4.0]), np.linspace(-4.0, 5.0, 31)
    spline = cubic_spline(nodes, nodes**3 - 2.0 * nodes)
    np.testing.assert_allclose(spline(x), x**3 - 2.0 * x, atol=1e-11)
    np.testing.assert_allclose(spline.derivative(x), 3.0 * x**2 - 2.0, atol=1e-11)


def test_three_nodes_are_too_few_for_a_spline() -> None:
    with pytest.raises(ValueError, match="needs 4"):
        cubic_spline(np.arange(3.0), np.zeros(3))


def test_least_squares_without_negative_coefficients_are_lawsons_and_hansons() -> None:
    rng = np.random.default_rng(1)
    for _ in range(300):
        rows, columns = int(rng.integers(4, 9)), int(rng.integers(1, 5))
        A = rng.normal(size=(rows, columns)) * 10 ** rng.uniform(-3, 1, columns)
        b = rng.normal(size=rows)
        x = nonnegative_least_squares(A, b)
        assert (x >= 0.0).all()
        np.testing.assert_allclose(A @ x, A @ nnls(A, b)[0], atol=1e-10)


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
