"""The ellipsoid, gravity and frames against published figures, round trips and derivatives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.physics import earth

LATITUDES = st.floats(-np.pi / 2, np.pi / 2)
LONGITUDES = st.floats(-np.pi, np.pi)
ALTITUDES = st.floats(-1e4, 1e6)
PLACES = [(0.0, 0.0, 0.0), (0.8, -2.0, 300.0), (-1.2, 3.0, 2e4), (1.5, 0.4, 1e5)]


def test_radii_at_equator_and_pole() -> None:
    # a (1 - e²), and a²/b of TR8350.2 table 3.3: polar radius of curvature 6399593.6258 m
    assert earth.principal_radii(0.0)[0] == pytest.approx(6335439.3273, abs=1e-3)
    assert earth.principal_radii(np.pi / 2) == pytest.approx((6399593.6258, 6399593.6258), abs=1e-3)


def test_normal_gravity_at_equator_pole_and_45_deg() -> None:
    assert earth.gravity(0.0, 0.0) == pytest.approx(earth.GRAVITY_EQUATOR_MPS2, abs=1e-12)
    assert earth.gravity(np.pi / 2, 0.0) == pytest.approx(earth.GRAVITY_POLE_MPS2, abs=1e-9)
    # γ45 = 9.80619920 of the GRS 80 series (H. Moritz, Geodetic Reference System 1980), which WGS-84 shares
    assert earth.gravity(np.pi / 4, 0.0) == pytest.approx(9.806199, abs=2e-6)


def test_gravity_falls_by_twice_its_size_over_the_radius() -> None:
    fall = earth.gravity(0.5, 0.0) - earth.gravity(0.5, 1000.0)
    assert fall == pytest.approx(2e3 * earth.gravity(0.5, 0.0) / earth.SEMI_MAJOR_AXIS_M, rel=1e-9)


@settings(deadline=None, max_examples=200)
@given(LATITUDES, LONGITUDES, ALTITUDES)
def test_ecef_round_trip(latitude: float, longitude: float, altitude: float) -> None:
    back = earth.ecef_to_lla(earth.lla_to_ecef(latitude, longitude, altitude))
    assert abs(back[0] - latitude) * 6.4e6 < 1e-8  # m; doubles at 7e6 m resolve 1e-9
    assert abs(back[2] - altitude) < 1e-8
    if abs(latitude) < 1.57:  # at the poles any longitude is the place
        assert abs(np.sin(0.5 * (back[1] - longitude))) < 1e-9


@pytest.mark.parametrize("place", PLACES)
def test_local_axes_are_the_directions_of_growing_latitude_longitude_depth(place: tuple[float, ...]) -> None:
    columns, step = [], 1e-6
    for i, scale in enumerate((step, step, -6.4e6 * step)):
        shift = np.zeros(3)
        shift[i] = scale
        way = earth.lla_to_ecef(*(place + shift)) - earth.lla_to_ecef(*(place - shift))
        columns.append(way / np.linalg.norm(way))
    # central differences over 6 m of a sphere's 6400 km and rounding of 1e-9 m in 6 m
    np.testing.assert_allclose(earth.ecef_from_ned(*place[:2]), np.transpose(columns), atol=2e-8)


@pytest.mark.parametrize("place", PLACES[:3])
def test_transport_rate_is_the_turning_of_the_local_frame(place: tuple[float, ...]) -> None:
    latitude, longitude, altitude = place
    velocity, t = np.array([200.0, -150.0, 30.0]), 1e-2
    meridian, transverse = earth.principal_radii(latitude)
    dlat = velocity[0] / (meridian + altitude) * t
    dlon = velocity[1] / (transverse + altitude) / np.cos(latitude) * t
    after, before = (earth.ecef_from_ned(latitude + s * dlat, longitude + s * dlon) for s in (0.5, -0.5))
    turn = earth.ned_from_ecef(latitude, longitude) @ (after - before) / t
    rate = np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
    np.testing.assert_allclose(rate, earth.transport_rate_ned(latitude, altitude, velocity), rtol=1e-6)


@pytest.mark.parametrize("place", PLACES)
def test_gravitation_is_gravity_without_the_centrifugal_part(place: tuple[float, ...]) -> None:
    latitude, longitude, altitude = place
    r = earth.lla_to_ecef(*place)
    rate = np.array([0.0, 0.0, earth.EARTH_RATE_RADPS])
    g = earth.ecef_from_ned(latitude, longitude) @ earth.gravity_ned(latitude, altitude)
    np.testing.assert_allclose(earth.gravitation(r), g + np.cross(rate, np.cross(rate, r)), atol=1e-12)


def test_earth_rate_points_along_the_axis() -> None:
    for latitude, longitude, _ in PLACES:
        e = earth.ecef_from_ned(latitude, longitude) @ earth.earth_rate_ned(latitude)
        np.testing.assert_allclose(e, [0.0, 0.0, earth.EARTH_RATE_RADPS], atol=1e-18)


def test_inertial_axes_turn_eastward() -> None:
    quarter = np.pi / 2 / earth.EARTH_RATE_RADPS
    np.testing.assert_allclose(
        earth.inertial_from_ecef(quarter) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12
    )


def test_arrays_of_places_give_what_single_places_give() -> None:
    latitude, longitude, altitude = np.transpose(PLACES)
    for k, place in enumerate(PLACES):
        np.testing.assert_array_equal(
            earth.ecef_from_ned(latitude, longitude)[k], earth.ecef_from_ned(*place[:2])
        )
        np.testing.assert_array_equal(
            earth.lla_to_ecef(latitude, longitude, altitude)[k], earth.lla_to_ecef(*place)
        )
