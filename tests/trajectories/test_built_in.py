"""The built-in flights: kinematics, closed forms, and what each is meant to show."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from planner.catalog import trajectories
from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics import earth
from planner.physics.attitude import cross, rotate
from planner.protocols import TrajectoryFamily
from tests.trajectories.flights import BUILT_IN, flight, mean_force_g, mean_rate_dps, rph_deg

every_flight = pytest.mark.parametrize("name", BUILT_IN)
EARTH_DPH = 15.041067  # WGS-84, deg/h


def slope(trajectory: Trajectory, values: Array) -> Array:
    """Fourth-order central difference at the inner instants 2 … n − 2."""
    h = trajectory.time_s[1]
    return (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) / (12 * h)


@every_flight
def test_is_a_family_with_readable_defaults(name: str) -> None:
    family = trajectories()[name]
    assert isinstance(family, TrajectoryFamily)
    assert family.parameters().duration > 0


@every_flight
def test_arrays_have_the_shapes_of_the_record(name: str) -> None:
    t = flight(name, duration="41 s", sampling_rate="20 Hz")
    n = 820
    assert t.name == name
    assert [
        x.shape for x in (t.time_s, t.latitude, t.longitude, t.altitude, t.temperature_degc, t.time_on)
    ] == [(n + 1,)] * 6
    assert (t.velocity.shape, t.attitude.shape) == ((n + 1, 3), (n + 1, 3, 3))
    assert t.angle_increment.shape == t.velocity_increment.shape == (n, 3)
    assert t.time_s[0] == 0.0
    assert t.time_s[-1] == 41.0
    np.testing.assert_allclose(np.diff(t.time_s), 0.05, rtol=1e-9)


@every_flight
def test_attitudes_are_rotations(name: str) -> None:
    c = flight(name).attitude
    np.testing.assert_allclose(np.swapaxes(c, 1, 2) @ c, np.broadcast_to(np.eye(3), c.shape), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(c), 1.0, atol=1e-13)


@every_flight
def test_velocity_is_the_derivative_of_the_position(name: str) -> None:
    t = flight(name, sampling_rate="200 Hz")
    meridian, transverse = earth.principal_radii(t.latitude)
    radii = np.stack(
        [meridian + t.altitude, (transverse + t.altitude) * np.cos(t.latitude), -np.ones(len(t.time_s))]
    )
    place = np.stack([t.latitude, t.longitude, t.altitude], axis=1)
    moving = slope(t, place - place[0]) * radii.T[2:-2]
    # 1e-4 m/s: the fourth-order difference's own error in the 80 g turns is 2e-5
    np.testing.assert_allclose(moving, t.velocity[2:-2], atol=1e-4)


@every_flight
def test_acceleration_is_specific_force_and_gravity_less_coriolis(name: str) -> None:
    t = flight(name, sampling_rate="200 Hz")
    rates = 2 * earth.earth_rate_ned(t.latitude) + earth.transport_rate_ned(
        t.latitude, t.altitude, t.velocity
    )
    expected = (
        slope(t, t.velocity)
        + cross(rates, t.velocity)[2:-2]
        - earth.gravity_ned(t.latitude, t.altitude)[2:-2]
    )
    middle = 0.5 * (t.velocity_increment[1:] + t.velocity_increment[:-1])[1:-1] / t.time_s[1]
    # a mean over two intervals is off by h²/6 f'': 0.2 m/s² where 80 g build up within 0.4 s
    tolerance = {"small_uav_1": 0.1, "small_uav_2": 0.3}.get(name, 0.01)
    np.testing.assert_allclose(rotate(t.attitude[2:-2], middle), expected, atol=tolerance)


@every_flight
def test_rate_is_the_attitude_s_and_the_local_frame_s(name: str) -> None:
    t = flight(name, sampling_rate="200 Hz")
    c = t.attitude
    turning = np.swapaxes(c[2:-2], 1, 2) @ slope(t, c)
    relative = np.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=1)
    frame = earth.earth_rate_ned(t.latitude) + earth.transport_rate_ned(t.latitude, t.altitude, t.velocity)
    expected = relative + rotate(np.swapaxes(c, 1, 2), frame)[2:-2]
    middle = 0.5 * (t.angle_increment[1:] + t.angle_increment[:-1])[1:-1] / t.time_s[1]
    # as above, h²/6 ω'': 2e-4 rad/s for 1 rad/s within 0.4 s
    np.testing.assert_allclose(middle, expected, atol=1e-3)


# ---------------------------------------------------------------- closed forms


@settings(deadline=None, max_examples=20)
@given(latitude=st.floats(-85, 85), heading=st.floats(-180, 180))
def test_at_rest_the_gyros_see_the_earth_and_the_accelerometers_gravity(
    latitude: float, heading: float
) -> None:
    t = flight(
        "static", latitude=f"{latitude:.6f} deg", heading=f"{heading:.6f} deg", duration="1 s", altitude="0 m"
    )
    phi, psi = np.radians(latitude), np.radians(heading)
    horizontal = EARTH_DPH / 3600 * np.cos(phi)
    expected = [horizontal * np.cos(psi), -horizontal * np.sin(psi), -EARTH_DPH / 3600 * np.sin(phi)]
    np.testing.assert_allclose(mean_rate_dps(t), np.broadcast_to(expected, (100, 3)), atol=1e-9)
    # Somigliana's closed form on the ellipsoid, TR8350.2 eq 4-1
    g = (
        9.7803253359
        * (1 + 0.00193185265241 * np.sin(phi) ** 2)
        / np.sqrt(1 - 0.00669437999013 * np.sin(phi) ** 2)
    )
    np.testing.assert_allclose(mean_force_g(t) * 9.80665, np.broadcast_to([0, 0, -g], (100, 3)), atol=1e-8)


def test_at_rest_gravity_lies_along_the_axis_that_points_up() -> None:
    nose_up = flight("static", pitch="90 deg", duration="1 s")
    right_up = flight("static", roll="-90 deg", duration="1 s")
    np.testing.assert_allclose(mean_force_g(nose_up)[0], [1.0003, 0, 0], atol=1e-3)
    np.testing.assert_allclose(mean_force_g(right_up)[0], [0, 1.0003, 0], atol=1e-3)


def test_level_flight_east_on_the_equator() -> None:
    t = flight("level", latitude="0 deg", heading="90 deg", speed="300 m/s", altitude="0 m", duration="100 s")
    a, spin = 6378137.0, np.radians(EARTH_DPH / 3600)
    assert t.longitude[-1] - t.longitude[0] == pytest.approx(30_000 / a, rel=1e-12)
    # round the Earth's axis at Ω + v/a: centripetal and Coriolis (Eötvös) in one
    eotvos = 2 * spin * 300 + 300**2 / a
    np.testing.assert_allclose(mean_force_g(t)[:, 2] * 9.80665, -(9.7803253359 - eotvos), atol=1e-7)
    np.testing.assert_allclose(mean_rate_dps(t)[:, 1], -np.degrees(spin + 300 / a), atol=1e-10)


def test_a_coordinated_turn_feels_no_force_sideways() -> None:
    t = flight("turn", speed="50 m/s", bank="30 deg", roll_in="5 s")
    force, steady = mean_force_g(t), slice(600, None)
    # Coriolis, 2 Ω v = 7 mm/s², is what is left
    assert np.abs(force[steady, 1]).max() < 1e-3
    np.testing.assert_allclose(force[steady, 2], -1 / np.cos(np.radians(30)), rtol=2e-3)
    rate = np.degrees(9.81 * np.tan(np.radians(30)) / 50)
    heading = np.unwrap(rph_deg(t)[steady, 2], period=360)
    assert np.diff(heading).mean() * 100 == pytest.approx(rate, rel=2e-3)
    assert np.linalg.norm(t.velocity, axis=1) == pytest.approx(50)


def test_a_full_circle_closes() -> None:
    period = 2 * np.pi * 50 / (9.81 * np.tan(np.radians(30)))
    t = flight("turn", duration="90 s")
    begin, end = 1000, 1000 + round(period * 100)
    north, east = (
        (t.latitude[end] - t.latitude[begin]) * 6.4e6,
        (t.longitude[end] - t.longitude[begin]) * 4.1e6,
    )
    # the radius is 440 m; 0.1 % of gravity and a sample of 10 ms leave some metres
    assert np.hypot(north, east) < 3.0


# ---------------------------------------------------------------- what each is meant to show


def test_small_uav_2_reaches_80_g() -> None:
    load = np.linalg.norm(mean_force_g(flight("small_uav_2")), axis=1)
    assert 79.9 < load.max() < 80.5


@pytest.mark.parametrize("load", [10, 40, 80])
def test_the_largest_load_is_the_one_asked_for(load: int) -> None:
    t = flight("small_uav_2", load=f"{load:.6f} g", boost_acceleration="10 g")
    across = np.linalg.norm(mean_force_g(t)[:, 1:], axis=1)
    # gravity's 1 g is carried on top, across or along the pull
    assert load - 0.1 < across.max() < load + 1.1


def test_small_uav_1_boosts_and_then_flies_free() -> None:
    t = flight("small_uav_1")
    force = np.linalg.norm(mean_force_g(t), axis=1)
    assert 20 < force.max() < 22
    assert force[410:].max() < 1.2  # drag alone, right after burn-out
    assert force[2500:4000].max() < 0.25  # and on top of the arc
    np.testing.assert_allclose(mean_force_g(t)[:90].mean(axis=0)[1], 0, atol=1e-6)
    np.testing.assert_allclose(t.velocity[:90], 0, atol=1e-12)  # at rest on the rail
    assert t.altitude.max() > 3000


def test_a_ballistic_flight_that_comes_down_too_early_is_refused() -> None:
    with pytest.raises(InputError, match=r"after 18.4 s, before its duration of 60 s"):
        flight("small_uav_1", boost_acceleration="5 g")


def test_small_uav_1_points_along_its_path() -> None:
    t = flight("small_uav_1")
    fast = np.linalg.norm(t.velocity, axis=1) > 10
    along = rotate(np.swapaxes(t.attitude, 1, 2), t.velocity)[fast]
    assert np.abs(along[:, 1:]).max() < 1e-6 * along[:, 0].max()


def test_helicopter_takes_off_hovers_turns_and_cruises() -> None:
    t = flight("helicopter", climb="40 m", turn="90 deg", heading="0 deg", speed="40 m/s")
    rph, speed = rph_deg(t), np.linalg.norm(t.velocity, axis=1)
    assert speed[0] == 0.0
    assert t.altitude[1800] - t.altitude[0] == pytest.approx(40, abs=1e-6)
    assert speed[1600:1900].max() < 1e-9  # hover
    assert rph[0, 2] == pytest.approx(0)
    assert rph[-1, 2] == pytest.approx(90)
    assert t.velocity[-1] == pytest.approx([0, 40, 0], abs=1e-9)
    assert rph[:, 1].min() < -15  # nose down to accelerate
    assert rph[-1, 1] == pytest.approx(-4)


def test_environment_comes_through() -> None:
    cold = {"start": "-50 degC", "end": "10 degC"}
    t = flight("level", duration="60 s", temperature=cold, time_on="10 min", day="30 day")
    assert (t.temperature_degc[0], t.temperature_degc[-1]) == (-50, 10)
    np.testing.assert_allclose(np.diff(t.temperature_degc), 0.01)
    assert (t.time_on[0], t.time_on[-1], t.day) == (600, 660, 30)


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("level", {"sped": "3 m/s"}, "sped"),
        ("level", {"speed": "3"}, "no unit"),
        ("level", {"speed": "3 deg"}, "m/s"),
        ("level", {"speed": "nan m/s"}, "number"),
        ("level", {"speed": "-3 m/s"}, "greater"),
        ("level", {"latitude": "90 deg"}, "not between -89 and 89 deg"),
        ("level", {"duration": "0 s"}, "greater"),
        ("level", {"duration": "1 day", "sampling_rate": "1000 Hz"}, "samples"),
        ("level", {"duration": "1 ms"}, "two samples"),
        ("turn", {"bank": "90 deg"}, "not between -80 and 80 deg"),
        ("small_uav_2", {"load": "100 g"}, "not between 0 and 80 g"),
        ("small_uav_1", {"elevation": "90 deg"}, "not between 10 and 85 deg"),
        ("static", {"temperature": "20"}, "temperature"),
        ("static", {"temperature": {"start": "20 degC"}}, "end"),
    ],
)
def test_impossible_parameters_are_refused(name: str, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        trajectories()[name].parameters(**parameters)
