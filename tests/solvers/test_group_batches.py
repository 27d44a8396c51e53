"""Groups of one size at a time, whether they follow one another or not."""

from __future__ import annotations

import numpy as np
import pytest

from planner.solvers.group_batches import batches_of, sums_of_groups
from planner.solvers.triangles import inverse_of_triangle, inverse_of_triangles, times_transposed


@pytest.mark.parametrize("sizes", [(3, 3, 3), (3, 2, 3, 2), (4,), (2, 2, 5, 1)])
@pytest.mark.parametrize("columns", [0, 1, 4])
def test_what_is_taken_goes_back_to_its_place(sizes: tuple[int, ...], columns: int) -> None:
    n, g = sum(sizes), len(sizes)
    starts = np.cumsum((0, *sizes))[:-1]
    rng = np.random.default_rng(1)
    A, S = rng.normal(size=(n, columns)), rng.normal(size=(g, 2, 2))
    rows, groups = np.full_like(A, np.nan), np.full_like(S, np.nan)
    for batch in batches_of(starts, np.array(sizes)):
        for place, theirs in zip(batch.places, batch.of(A), strict=True):
            np.testing.assert_array_equal(theirs, A[starts[place] : starts[place] + sizes[place]])
        batch.put(rows, batch.of(A))
        batch.put_groups(groups, batch.of_groups(S))
    np.testing.assert_array_equal(rows, A)
    np.testing.assert_array_equal(groups, S)


@pytest.mark.parametrize("sizes", [(3, 3, 3), (3, 2, 3, 2), (2, 2, 5, 1)])
def test_each_group_is_multiplied_by_its_own_factor(sizes: tuple[int, ...]) -> None:
    starts = np.cumsum((0, *sizes))[:-1]
    rng = np.random.default_rng(3)
    A, factors = rng.normal(size=(sum(sizes), 4)), [rng.normal(size=(m, m)) for m in sizes]
    out = np.full_like(A, np.nan)
    for batch in batches_of(starts, np.array(sizes)):
        batch.put_product(out, np.array([factors[place] for place in batch.places]), A)
    wanted = [f @ A[a : a + m] for f, a, m in zip(factors, starts, sizes, strict=True)]
    np.testing.assert_allclose(out, np.concatenate(wanted), atol=1e-14)


@pytest.mark.parametrize("r", [0, 1, 7, 40])
def test_triangles_are_inverted_and_multiplied_as_any_matrix(r: int) -> None:
    rng = np.random.default_rng(2)
    L = np.tril(rng.normal(size=(3, r, r))) + 3.0 * np.sqrt(max(r, 1)) * np.eye(r)
    X = rng.normal(size=(50, r))
    np.testing.assert_allclose(inverse_of_triangle(L[0]), np.linalg.inv(L[0]), atol=1e-13)
    np.testing.assert_allclose(inverse_of_triangles(L), np.linalg.inv(L), atol=1e-13)
    np.testing.assert_allclose(times_transposed(X, L[0]), X @ L[0].T, atol=1e-12)


@pytest.mark.parametrize("columns", [0, 1, 49, 50, 120])
def test_sums_of_groups_are_those_of_their_rows(columns: int) -> None:
    starts = np.array([0, 3, 4, 9])
    A = np.random.default_rng(2).normal(size=(11, columns))
    wanted = [A[a:b].sum(axis=0) for a, b in ((0, 3), (3, 4), (4, 9), (9, 11))]
    np.testing.assert_allclose(sums_of_groups(A, starts), np.array(wanted), atol=1e-14)


@pytest.mark.parametrize("columns", [1, 120])
def test_rows_are_weighed_in_their_sums(columns: int) -> None:
    starts, rng = np.array([0, 3, 4, 9]), np.random.default_rng(5)
    A, weights = rng.normal(size=(11, columns)), rng.normal(size=11)
    wanted = sums_of_groups(weights[:, None] * A, starts)
    np.testing.assert_allclose(sums_of_groups(A, starts, weights), wanted, atol=1e-14)
