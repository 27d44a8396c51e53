"""The ideal readings return the flight: by our own integrator, by python-ins, by Runge-Kutta."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.nouns.trajectory import Trajectory
from planner.physics.strapdown import NavigationState, integrate
from tests.trajectories.flights import BUILT_IN, apart, end_by_runge_kutta, flight, motion_of, rph_deg

every_flight = pytest.mark.parametrize("name", BUILT_IN)


def returned(trajectory: Trajectory) -> float:
    """Metres between the end of the flight and where our integrator ends on its readings."""
    t = trajectory
    start = NavigationState(t.latitude[0], t.longitude[0], t.altitude[0], t.velocity[0], t.attitude[0])
    end = integrate(start, t.angle_increment, t.velocity_increment, float(t.time_s[1]))
    north = (end.latitude - t.latitude[-1]) * 6.4e6
    east = (end.longitude - t.longitude[-1]) * 6.4e6 * np.cos(t.latitude[-1])
    return float(np.linalg.norm([north, east, end.altitude - t.altitude[-1]]))


@every_flight
def test_returns_within_a_centimetre_after_a_minute_at_100_hz(name: str) -> None:
    assert returned(flight(name, duration="60 s", sampling_rate="100 Hz")) < 0.01


@settings(deadline=None, max_examples=5)
@given(
    name=st.sampled_from(BUILT_IN),
    latitude=st.floats(-80, 80),
    longitude=st.floats(-180, 180),
    heading=st.floats(-180, 180),
    altitude=st.floats(0, 10_000),
)
def test_returns_from_anywhere_in_any_direction(
    name: str, latitude: float, longitude: float, heading: float, altitude: float
) -> None:
    place = {
        "latitude": f"{latitude:.6f} deg",
        "longitude": f"{longitude:.6f} deg",
        "altitude": f"{altitude:.6f} m",
    }
    assert returned(flight(name, heading=f"{heading:.6f} deg", **place)) < 0.01


@settings(deadline=None, max_examples=3)
@given(load=st.floats(1, 80), boost=st.floats(10, 40), speed=st.floats(200, 500), roll=st.floats(-180, 180))
def test_high_loads_return(load: float, boost: float, speed: float, roll: float) -> None:
    settings_ = {"load": f"{load:.6f} g", "boost_acceleration": f"{boost:.6f} g", "speed": f"{speed:.6f} m/s"}
    assert returned(flight("small_uav_2", roll=f"{roll:.6f} deg", **settings_)) < 0.01


@settings(deadline=None, max_examples=3)
@given(elevation=st.floats(55, 80), boost=st.floats(25, 60), time=st.floats(3, 5))
def test_ballistic_flights_return(elevation: float, boost: float, time: float) -> None:
    parameters = {
        "elevation": f"{elevation:.6f} deg",
        "boost_acceleration": f"{boost:.6f} g",
        "boost_time": f"{time:.6f} s",
    }
    assert returned(flight("small_uav_1", **parameters)) < 0.01


@settings(deadline=None, max_examples=5)
@given(speed=st.floats(15, 300), bank=st.floats(-70, 70), roll_in=st.floats(2, 20))
def test_turns_return(speed: float, bank: float, roll_in: float) -> None:
    parameters = {"speed": f"{speed:.6f} m/s", "bank": f"{bank:.6f} deg", "roll_in": f"{roll_in:.6f} s"}
    assert returned(flight("turn", **parameters)) < 0.01


@pytest.mark.parametrize("name", ["small_uav_2", "turn"])
@pytest.mark.further("name", ["helicopter", "small_uav_1"])
def test_continuous_readings_obey_newton_in_the_earth_fixed_frame(name: str, monkeypatch: Any) -> None:
    trajectory, motion = motion_of(name, monkeypatch, sampling_rate="50 Hz")
    metres, turned = end_by_runge_kutta(trajectory, motion)
    # the rule's own error falls with h⁴: 5e-6 m at 100 Hz at 80 g, so 1e-4 m at 50 Hz
    assert metres < 2e-4
    assert turned < 1e-8


@every_flight
def test_increments_add_up_over_coarser_intervals(name: str) -> None:
    fine, coarse = (flight(name, sampling_rate=rate) for rate in ("200 Hz", "100 Hz"))
    for kind in ("angle_increment", "velocity_increment"):
        pairs = getattr(fine, kind).reshape(-1, 2, 3).sum(axis=1)
        # both are quadratures of one curve: 1e-8 is far below any sensor and far above rounding
        np.testing.assert_allclose(pairs, getattr(coarse, kind), atol=1e-8)
    np.testing.assert_allclose(fine.latitude[::2], coarse.latitude, atol=1e-15, rtol=0)


def by_python_ins(trajectory: Trajectory) -> float:
    """Metres between the end of the flight and where python-ins ends on its readings."""
    import pandas as pd
    from pyins import strapdown, util

    readings = np.hstack([trajectory.angle_increment, trajectory.velocity_increment])
    imu = pd.DataFrame(
        np.vstack([readings[:1], readings]), index=trajectory.time_s, columns=util.GYRO_COLS + util.ACCEL_COLS
    )
    place = [np.degrees(trajectory.latitude[0]), np.degrees(trajectory.longitude[0]), trajectory.altitude[0]]
    start = pd.Series([*place, *trajectory.velocity[0], *rph_deg(trajectory)[0]], index=util.TRAJECTORY_COLS)
    end = (
        strapdown.Integrator(start)
        .integrate(strapdown.compute_increments_from_imu(imu, "increment"))
        .iloc[-1]
    )
    north = (np.radians(end.lat) - trajectory.latitude[-1]) * 6.4e6
    east = (np.radians(end.lon) - trajectory.longitude[-1]) * 6.4e6 * np.cos(trajectory.latitude[-1])
    return float(np.linalg.norm([north, east, end.alt - trajectory.altitude[-1]]))


@pytest.mark.filterwarnings("ignore:The copy keyword is deprecated")
@pytest.mark.parametrize("name", ["helicopter", "level", "static", "turn"])
def test_python_ins_returns_within_a_centimetre(name: str) -> None:
    assert by_python_ins(flight(name)) < 0.01


@pytest.mark.filterwarnings("ignore:The copy keyword is deprecated")
@pytest.mark.parametrize("name", ["small_uav_1", "small_uav_2"])
def test_python_ins_converges_to_the_flight(name: str) -> None:
    # its Coriolis term takes the velocity at the start of each step: first order, 1 and 4 cm at 100 Hz
    coarse, fine = (by_python_ins(flight(name, sampling_rate=rate)) for rate in ("100 Hz", "1000 Hz"))
    assert coarse < 0.05
    assert fine < 0.2 * coarse


def test_the_same_parameters_give_the_same_bytes() -> None:
    one, other = flight("small_uav_2"), flight("small_uav_2")
    assert one.velocity_increment.tobytes() == other.velocity_increment.tobytes()
    assert apart(one, other).max() == 0.0
