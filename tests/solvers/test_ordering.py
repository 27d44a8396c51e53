"""Orders against every order."""

from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.solvers.calendar import calendar, constant
from planner.solvers.ordering import (
    MOST_STOPS,
    Stops,
    best_order,
    best_up_and_down,
    sweep,
)

WEEK = 168.0

temperatures = st.lists(st.floats(-60, 60).map(lambda t: round(t, 1)), min_size=0, max_size=6, unique=True)
speeds = st.one_of(st.none(), st.floats(0.5, 8))


def travel_time(order, home, up, down):
    """Time of home → order → home at speeds `up` and `down` (None: no time), in units of 1/speed."""
    way = [(b - a, up if b > a else down) for a, b in pairwise([home, *order, home])]
    return sum(abs(step) / speed for step, speed in way if speed)


@settings(deadline=None, max_examples=60)
@given(temperatures, st.floats(-80, 90), speeds, speeds)
def test_no_order_travels_less(points, home, up, down):
    best = min(travel_time(order, home, up, down) for order in permutations(points))
    assert travel_time(sweep(points), home, up, down) == pytest.approx(best, rel=1e-12)
    assert travel_time(sweep(points)[::-1], home, up, down) == pytest.approx(best, rel=1e-12)


def random_stops(rng: np.random.Generator, n: int) -> Stops:
    """A chamber with its ramps and soak, and tests of which some need people; hours."""
    hours = calendar(WEEK, [(24 * d + 8, 24 * d + rng.integers(10, 18)) for d in range(rng.integers(1, 7))])
    places = np.sort(rng.choice(np.arange(-60, 61, 5), n, replace=False)).astype(float)
    up, down, soak, home = rng.uniform(4, 30), rng.uniform(4, 30), rng.choice([0.0, 0.5, 1.0]), 20.0
    ramp = np.subtract.outer(places, places)
    work = []
    for _ in range(n):
        powered = float(rng.choice([0.2, 0.5, 1.5]))
        attended = [] if rng.random() < 0.3 else [(0.0, 0.1), (powered - 0.1, powered)]
        work.append(
            hours.passage(attended, powered).then(constant(0.25, WEEK)).times(int(rng.integers(1, 6)))
        )
    return Stops(
        np.where(places > home, (places - home) / up, (home - places) / down) + soak,
        np.where(ramp < 0, -ramp / up, ramp / down) + soak,
        np.where(places > home, (places - home) / down, (home - places) / up),
        work,
    )


@pytest.mark.parametrize("seed", [0])
@pytest.mark.further("seed", [1, 2])
def test_no_order_under_shifts_is_home_earlier(seed):
    """250 cases a seed of up to six temperatures, every permutation of each."""
    rng, better = np.random.default_rng(seed), 0
    for _ in range(250):
        stops = random_stops(
            rng, int(rng.choice([1, 2, 3, 4, 4, 5, 5, 6], p=[0.05] * 3 + [0.25] * 3 + [0.06, 0.04]))
        )
        start = float(rng.uniform(0, WEEK))
        homes = [stops.home_at(order, start) for order in permutations(range(len(stops)))]
        order = best_order(stops, start)
        assert sorted(order) == list(range(len(stops)))
        assert stops.home_at(order, start) == pytest.approx(min(homes), abs=1e-5)
        better += min(homes) < stops.home_at(range(len(stops)), start) - 1e-5
    assert better > 25  # else every order would have passed


@pytest.mark.parametrize("seed", [0])
@pytest.mark.further("seed", [1])
def test_no_way_up_and_down_under_shifts_is_home_earlier(seed):
    rng, turned = np.random.default_rng(seed), 0
    for _ in range(250):
        stops = random_stops(rng, int(rng.integers(1, 7)))
        n, start = len(stops), float(rng.uniform(0, WEEK))
        allowed = [order for order in permutations(range(n)) if is_up_and_down(order)]
        assert len(allowed) == 2 ** (n - 1)
        order = best_up_and_down(stops, start)
        assert order in allowed
        best = min(stops.home_at(o, start) for o in allowed)
        assert stops.home_at(order, start) == pytest.approx(best, abs=1e-5)
        turned += order != tuple(range(n))
    assert turned > 25


def is_up_and_down(order: tuple[int, ...]) -> bool:
    top = order.index(max(order))
    return (
        list(order[: top + 1]) == sorted(order[: top + 1]) and list(order[top:]) == sorted(order[top:])[::-1]
    )


def test_where_nothing_waits_the_order_ascends():
    stops = Stops(np.ones(5), np.ones((5, 5)), np.ones(5), [constant(2.0, WEEK)] * 5)
    assert best_order(stops, 3.0) == best_up_and_down(stops, 3.0) == (0, 1, 2, 3, 4)


def test_more_stops_than_the_tables_hold_are_refused():
    n = MOST_STOPS + 1
    stops = Stops(np.ones(n), np.ones((n, n)), np.ones(n), [constant(2.0, WEEK)] * n)
    for solve in (best_order, best_up_and_down):
        with pytest.raises(ValueError, match="exact up to"):
            solve(stops, 0.0)


def test_no_stops_need_no_order():
    nothing = Stops(np.zeros(0), np.zeros((0, 0)), np.zeros(0), [])
    assert best_order(nothing, 0.0) == best_up_and_down(nothing, 0.0) == ()
    assert nothing.home_at((), 7.0) == 7.0
