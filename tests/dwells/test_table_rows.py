"""Rows that are the same are found by a number of their bits as by sorting them."""

from __future__ import annotations

import numpy as np

from planner.dwells.table_rows import alike


def test_rows_that_are_the_same_have_one_number_and_the_first_of_them_stands() -> None:
    rows = np.random.default_rng(0).integers(-3, 3, (5000, 4)) / 7.0
    first, which = alike(rows)
    np.testing.assert_array_equal(rows[first][which], rows)
    assert sorted(first) == sorted(np.unique(rows, axis=0, return_index=True)[1])


def test_zero_and_minus_zero_are_the_same() -> None:
    assert len(alike(np.array([[0.0, 1.0], [-0.0, 1.0]]))[0]) == 1
