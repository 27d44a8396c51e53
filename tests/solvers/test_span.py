"""Projections without a basis are those with one, of tall columns and short ones, copies among them."""

from __future__ import annotations

import numpy as np
import pytest

from planner.solvers.least_squares import directions, factors
from planner.solvers.span import Span

TOLERANCE = 1e-5


@pytest.mark.parametrize(("rows", "columns"), [(900, 40), (60, 40), (500, 1)])
def test_it_projects_and_counts_as_an_orthonormal_basis_does(rows: int, columns: int) -> None:
    rng = np.random.default_rng(rows)
    X = rng.normal(size=(rows, columns)) * 10.0 ** rng.uniform(-6.0, 6.0, columns)
    X = np.column_stack([X, X[:, 0] * 3.0, X[:, -1] * (1.0 + 1e-3 * rng.normal(size=rows))])
    y, Q = rng.normal(size=rows), factors(X, TOLERANCE).basis
    span = Span.of(X, TOLERANCE)
    assert span.rank == Q.shape[1] == columns + 1
    np.testing.assert_allclose(span.clear(y), y - Q @ (Q.T @ y), atol=1e-10 * np.linalg.norm(y))
    sums = np.add.reduceat(X, np.arange(0, rows, 10), axis=0)
    wanted = np.sum(np.add.reduceat(Q, np.arange(0, rows, 10), axis=0) ** 2)
    assert span.energy(sums) == pytest.approx(wanted, rel=1e-4)


def test_no_columns_span_nothing() -> None:
    span, y = Span.of(np.empty((500, 0)), TOLERANCE), np.arange(500.0)
    assert span.rank == 0
    np.testing.assert_array_equal(span.clear(y), y)


def test_a_rough_basis_is_orthonormal_to_a_ten_thousandth() -> None:
    rng = np.random.default_rng(2)
    X = rng.normal(size=(2000, 60)) @ np.diag(np.geomspace(1.0, 3e-5, 60)) @ rng.normal(size=(60, 60))
    for Q in (factors(X, TOLERANCE, roughly=True).basis, X @ directions(X, TOLERANCE)):
        assert np.abs(Q.T @ Q - np.eye(Q.shape[1])).max() < 1e-4
    exact = factors(X, TOLERANCE).basis
    assert np.abs(exact.T @ exact - np.eye(exact.shape[1])).max() < 1e-12
