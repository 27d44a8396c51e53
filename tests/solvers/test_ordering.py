"""The sweep against every order."""

from itertools import permutations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.solvers.ordering import sweep, travel_time


@settings(deadline=None, max_examples=100)
@given(
    st.lists(st.integers(-60, 80), min_size=1, max_size=6, unique=True),
    st.integers(-60, 80),
    st.floats(0.5, 8),
    st.floats(0.5, 8),
)
def test_no_order_travels_less(points, home, up, down):
    best = min(travel_time(order, home, up, down) for order in permutations(points))
    assert travel_time(sweep(points), home, up, down) == pytest.approx(best, rel=1e-12)


def test_without_speeds_travel_takes_no_time():
    assert travel_time((-60, 60), 20, None, None) == 0
