"""Placement of table nodes against every placement there is."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.solvers.breakpoints import optimal_breakpoints, table_residual


def curve(seed: int, points: int):
    rng = np.random.default_rng(seed)
    return np.sort(rng.choice(200, points, replace=False)).astype(float), rng.normal(size=points)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10_000), st.integers(2, 9))
def test_no_placement_leaves_less(seed, points):
    x, y = curve(seed, points)
    for count, placement in enumerate(optimal_breakpoints(x, y, points), start=1):
        best = min(
            table_residual(x, y, x[list(nodes)], y[list(nodes)])
            for nodes in combinations(range(points), count)
        )
        assert placement.residual == pytest.approx(best, abs=1e-12)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10_000), st.integers(2, 40))
def test_the_residual_told_is_that_of_the_nodes_told_and_every_point_a_node_leaves_none(seed, points):
    x, y = curve(seed, points)
    placements = optimal_breakpoints(x, y, points)
    for placement in placements:
        nodes = list(placement.indices)
        assert table_residual(x, y, x[nodes], y[nodes]) == pytest.approx(placement.residual, abs=1e-12)
    assert placements[-1].residual == 0


def test_a_node_too_many_can_leave_more():
    # exactly n nodes are placed, all on the curve: the extra one may have to be an outlier
    x, y = curve(1, 5)
    residuals = [p.residual for p in optimal_breakpoints(x, y, 5)]
    assert any(b > a for a, b in pairwise(residuals))


def test_a_bent_line_needs_its_bend_and_nothing_else():
    x = np.arange(11.0)
    y = np.where(x < 6, 0.5 * x, 3 - 2 * (x - 6))
    assert optimal_breakpoints(x, y, 3)[2].indices == (0, 6, 10)


@pytest.mark.parametrize("x", [[1.0], [0.0, 0.0], [1.0, 0.0]])
def test_a_curve_that_does_not_increase_is_refused(x):
    with pytest.raises(ValueError, match="increasing"):
        optimal_breakpoints(np.array(x), np.zeros(len(x)), 1)
