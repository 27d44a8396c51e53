"""Laws of a motion with limited rate and acceleration."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.bench_run.simulator.axis import Axis

orders = st.lists(
    st.tuples(
        st.sampled_from(["position", "rate"]),
        st.floats(-720, 720),
        st.floats(0.0, 20.0),
    ),
    min_size=1,
    max_size=6,
)
FASTEST, STRONGEST = 100.0, 50.0


@given(orders)
@settings(deadline=None, max_examples=150)
def test_rate_and_acceleration_stay_within_limits_and_nothing_jumps(given_orders):
    axis, now = Axis(), 0.0
    for kind, value, pause in given_orders:
        if kind == "position":
            axis.to_position(now, value, FASTEST, STRONGEST)
        else:
            axis.to_rate(now, math.remainder(value, FASTEST), STRONGEST)
        now += pause
    times = np.linspace(0.0, now + 40.0, 4001)
    states = np.array([axis.at(t) for t in times])
    step = times[1]
    assert np.abs(states[:, 1]).max() <= FASTEST * (1 + 1e-9)
    assert np.abs(np.diff(states[:, 1])).max() <= STRONGEST * step * (1 + 1e-6) + 1e-9
    moved = np.diff(states[:, 0])
    trapezoid = step * (states[1:, 1] + states[:-1, 1]) / 2
    np.testing.assert_allclose(moved, trapezoid, atol=STRONGEST * step**2)  # a kink within a sample


@given(orders, st.floats(-720, 720))
@settings(deadline=None, max_examples=150)
def test_from_any_state_it_comes_to_the_angle_and_stays(given_orders, target):
    axis, now = Axis(), 0.0
    for kind, value, pause in given_orders:
        (
            axis.to_position(now, value, FASTEST, STRONGEST)
            if kind == "position"
            else axis.to_rate(now, value / 10, 50.0)
        )
        now += pause
    axis.to_position(now, target, FASTEST, STRONGEST)
    for later in (now + 30.0, now + 1e6):
        position, rate = axis.at(later)
        assert abs(math.remainder(position - target, 360.0)) < 1e-6
        assert rate == 0.0


@given(st.floats(-1000, 1000), st.floats(-1000, 1000))
@settings(deadline=None, max_examples=100)
def test_a_continuous_axis_takes_the_shortest_way_in_the_shortest_time(start, target):
    axis = Axis()
    axis.to_position(0.0, start, FASTEST, STRONGEST)
    here = axis.at(100.0).position_deg
    axis.to_position(100.0, target, FASTEST, STRONGEST)
    way = abs(axis.at(200.0).position_deg - here)
    assert way <= 180.0 + 1e-9
    ramp = FASTEST**2 / STRONGEST  # closed form of the trapezoid
    time = 2 * math.sqrt(way / STRONGEST) if way < ramp else way / FASTEST + FASTEST / STRONGEST
    assert axis.at(100.0 + time + 1e-6).rate_dps == pytest.approx(0.0, abs=1e-3)
    if way > 1e-3:
        assert axis.at(100.0 + 0.99 * time).rate_dps != 0.0


def test_an_axis_with_stops_goes_straight():
    axis = Axis((-10.0, 350.0))
    axis.to_position(0.0, 340.0, FASTEST, STRONGEST)
    assert axis.at(2.5).position_deg > 50.0
    assert axis.at(60.0).position_deg == pytest.approx(340.0)
