"""What is remembered of campaigns is what would be found anew."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.information import remembered
from planner.information.remembered import Left, Remembered
from planner.nouns.array import Array

COUNTS = st.lists(st.tuples(*[st.integers(0, 2)] * 3), min_size=1, max_size=5)


def leaves(counts: Array, families: Sequence[int]) -> Left:
    """Two requirements of other sizes, of campaign and family; one campaign leaves nothing determined."""
    size = (counts @ [1.0, 10.0, 100.0])[:, None] + np.array([0.1 * f for f in families])
    return [size[..., None, None] * np.eye(2), -size[..., None]], counts.sum(axis=1) == 0


def figures_of(left: Left) -> Array:
    """One a requirement."""
    return np.stack([np.trace(left[0][0], axis1=2, axis2=3), left[0][1][..., 0]], axis=2)


@given(st.lists(st.tuples(COUNTS, st.sets(st.integers(0, 3), min_size=1)), max_size=8), st.integers(1, 40))
def test_as_found_anew(asked: list[tuple[list[tuple[int, ...]], set[int]]], most: int) -> None:
    known, usual = Remembered(), remembered.MOST
    remembered.MOST = most  # forgets on the way
    try:
        for counts, families in asked:
            n, chosen = np.array(counts, dtype=float), sorted(families)
            found, wanted = known.left(n, chosen, leaves), leaves(n, chosen)
            np.testing.assert_array_equal(found[1], wanted[1])
            for x, y in zip(found[0], wanted[0], strict=True):
                np.testing.assert_array_equal(x, y)
            figures = known.figures(n, chosen, leaves, figures_of)
            np.testing.assert_array_equal(figures, figures_of(wanted))
    finally:
        remembered.MOST = usual


def test_nothing_is_asked_twice() -> None:
    known, asked = Remembered(), list[int]()

    def counted(counts: Array, families: Sequence[int]) -> Left:
        asked.append(len(counts))
        return leaves(counts, families)

    n = np.array([[1.0, 0, 0], [0, 1, 0], [1, 0, 0]])
    known.left(n, [0, 1], counted)
    known.left(n[:2], [1], counted)
    known.left(np.array([[1.0, 0, 0], [2, 0, 0]]), [0], counted)
    assert asked == [2, 1]
    figured = list[int]()

    def once(left: Left) -> Array:
        figured.append(len(left[1]))
        return figures_of(left)

    known.figures(n, [0, 1], counted, once)
    known.figures(n[1:], [1], counted, once)
    assert (asked, figured) == ([2, 1], [2])
