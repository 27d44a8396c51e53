"""Waiting for shifts against a search in small steps."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from planner.solvers.calendar import SLACK, Calendar, calendar, constant

PERIOD = 20.0

whole = st.integers(0, 19)
windows = st.lists(st.tuples(whole, st.integers(1, 15)), min_size=1, max_size=4)
spans = st.lists(st.tuples(st.integers(0, 25), st.integers(0, 4)), min_size=1, max_size=3)


def open_at(opening, moment):
    # the latest moment asked for is 39.5 ready + 60 searched + 29 into the work
    return any(a <= moment + k * PERIOD <= b for a, b in opening for k in range(-7, 4))


def fits(opening, start, attended):
    """Everything happens on a grid of halves, so that to look at every half is to look at all of it."""
    return all(
        open_at(opening, start + moment) for a, b in attended for moment in np.arange(2 * a, 2 * b + 1) / 2
    )


def searched(opening, ready, attended, seconds):
    """The first start on the grid: windows and spans are whole, so no better one lies between."""
    for start in np.arange(ready, ready + 3 * PERIOD, 0.5):
        if fits(opening, start, attended):
            return start + seconds
    return None


@settings(deadline=None, max_examples=300)
@given(windows, spans, st.integers(0, 79), st.integers(0, 30))
@example([(0, 1)], [(23, 1)], 75, 0)
def test_work_waits_until_people_are_there_for_all_of_it(shifts, attended, half_ready, seconds):
    opening = [(a, a + length) for a, length in shifts]
    attended = [(a, a + length) for a, length in attended]
    ready = half_ready / 2
    expected = searched(opening, ready, attended, seconds)
    hours = calendar(PERIOD, opening)
    if expected is None:
        with pytest.raises(ValueError, match="no shift"):
            hours.passage(attended, seconds)
        return
    # a start may be SLACK early at the end of a shift; nothing else rounds, the figures are halves
    assert float(hours.passage(attended, seconds)(ready)) == pytest.approx(expected, abs=2 * SLACK)


def passage(hours, rng):
    """Some work of one to three blocks that fits."""
    attended = [(float(a), float(a) + rng.integers(0, 3)) for a in rng.integers(0, 4, rng.integers(1, 3))]
    try:
        return hours.passage(attended, float(rng.integers(4, 9)))
    except ValueError:
        return constant(float(rng.integers(1, 30)), hours.period)


@settings(deadline=None, max_examples=200)
@given(st.integers(0, 2**32 - 1), windows)
def test_work_in_a_row_is_done_one_after_the_other(seed, shifts):
    rng = np.random.default_rng(seed)
    hours = calendar(PERIOD, [(a, a + length) for a, length in shifts])
    parts = [passage(hours, rng) for _ in range(4)]
    total, t = constant(0.0, PERIOD), rng.uniform(-50, 50, 200)
    expected = t
    for part in parts:
        total, expected = total.then(part), part(expected)
    # breaks closer than 1e-7 s to each other are merged; t falls between two such breaks with probability 0
    assert np.allclose(total(t), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("count", [0, 1, 2, 5, 13])
def test_repeats_are_the_same_work_in_a_row(count):
    hours = calendar(PERIOD, [(3, 9), (12, 13.5)])
    once, t = hours.passage([(0, 1)], 2.7), np.linspace(-30, 50, 997)
    expected = t
    for _ in range(count):
        expected = once(expected)
    assert np.allclose(once.times(count)(t), expected, rtol=0, atol=1e-9)


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 2**32 - 1), windows)
def test_who_comes_later_is_never_done_earlier_and_every_week_is_alike(seed, shifts):
    rng = np.random.default_rng(seed)
    hours = calendar(PERIOD, [(a, a + length) for a, length in shifts])
    work = passage(hours, rng).then(passage(hours, rng))
    t = np.sort(rng.uniform(0, PERIOD, 100))
    assert np.all(np.diff(work(t)) >= 0)
    assert np.allclose(work(t + PERIOD), work(t) + PERIOD, rtol=0, atol=1e-9)


def test_shifts_that_touch_are_one_and_a_full_week_is_always():
    assert calendar(PERIOD, [(0, 5), (5, 8)]).windows == ((0, 8),)
    assert calendar(PERIOD, [(18, 22), (1, 4)]).windows == ((18, 24),)
    assert calendar(PERIOD, [(0, 10), (10, 20)]).always
    assert calendar(PERIOD, [(15, 26), (5, 16)]).always
    assert calendar(PERIOD, [(2, 4)]).longest == 2


def test_without_people_nothing_waits():
    always = Calendar(PERIOD, (), always=True)
    assert always.passage([(0, 100)], 100).is_constant
    assert calendar(PERIOD, [(2, 4)]).passage([], 7).is_constant
    with pytest.raises(ValueError, match="no shift"):
        Calendar(PERIOD, ()).passage([(0, 0)], 1)
