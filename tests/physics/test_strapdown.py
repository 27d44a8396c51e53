"""The batch strapdown returns the flights that its readings were made from, and keeps the laws."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner.nouns.trajectory import Trajectory
from planner.physics import earth
from planner.physics.attitude import rotation_vector_from_dcm
from planner.physics.strapdown import NavigationState, compensate, from_inertial, integrate, to_inertial
from tests.physics.flights import AT_REST, CRUISE, HARD, MANOEUVRES, SPIN, Flight, fly

FLIGHTS = {"manoeuvres": MANOEUVRES, "cruise": CRUISE, "rest": AT_REST, "hard": HARD, "spin": SPIN}


def start_of(flight: Trajectory) -> NavigationState:
    return NavigationState(
        flight.latitude[0], flight.longitude[0], flight.altitude[0], flight.velocity[0], flight.attitude[0]
    )


def navigate(flight: Trajectory, instants: list[float] | None = None) -> NavigationState:
    step = flight.time_s[1]
    return integrate(
        start_of(flight), flight.angle_increment, flight.velocity_increment, step, instants=instants
    )


def miss(state: NavigationState, flight: Trajectory, sample: int) -> tuple[float, float, float]:
    """Distance (m), velocity (m/s) and angle (rad) between a state and the flight."""
    there = earth.lla_to_ecef(flight.latitude[sample], flight.longitude[sample], flight.altitude[sample])
    distance = earth.lla_to_ecef(state.latitude, state.longitude, state.altitude) - there
    turn = rotation_vector_from_dcm(state.attitude @ flight.attitude[sample].T)
    return tuple(np.linalg.norm(x) for x in (distance, state.velocity - flight.velocity[sample], turn))


@pytest.mark.parametrize("name", FLIGHTS)
def test_ideal_readings_return_the_flight(name: str) -> None:
    flight = fly(FLIGHTS[name], 60.0)
    distance, velocity, angle = miss(navigate(flight), flight, -1)
    assert distance < 1e-3  # asked is 1 cm
    assert velocity < 1e-4
    assert angle < 1e-7


@pytest.mark.parametrize("name", ["manoeuvres", "hard"])
def test_the_miss_falls_with_a_high_power_of_the_interval(name: str) -> None:
    misses = [miss(navigate(f), f, -1)[2] for f in (fly(FLIGHTS[name], 20.0, rate) for rate in (25.0, 50.0))]
    # sixth order inside, slopes of the readings of fourth: at least 2^4 per halving
    assert misses[0] / misses[1] > 16.0


def test_ten_minutes_of_cruise() -> None:
    flight = fly(CRUISE, 600.0)
    assert miss(navigate(flight), flight, -1)[0] < 1e-2


def test_states_at_chosen_instants() -> None:
    flight = fly(HARD, 30.0)
    states = navigate(flight, [0.0, 12.34, 30.0, 5.0])
    assert states.latitude.shape == (4,)
    for k, sample in enumerate((0, 1234, 3000, 500)):
        one = NavigationState(
            states.latitude[k],
            states.longitude[k],
            states.altitude[k],
            states.velocity[k],
            states.attitude[k],
        )
        assert miss(one, flight, sample)[0] < 1e-3


def test_a_batch_is_its_single_runs() -> None:
    flight, rng = fly(MANOEUVRES, 20.0), np.random.default_rng(2)
    angle = flight.angle_increment + 1e-4 * rng.normal(size=(7, 2000, 3))
    velocity = flight.velocity_increment * (1.0 + 1e-3 * rng.normal(size=(7, 1, 3)))
    batch = integrate(start_of(flight), angle, velocity, 0.01)
    for k in range(7):
        one = integrate(start_of(flight), angle[k], velocity[k], 0.01)
        np.testing.assert_array_equal(batch.velocity[k], one.velocity)
        np.testing.assert_array_equal(batch.attitude[k], one.attitude)
        np.testing.assert_array_equal(batch.altitude[k], one.altitude)


def test_what_is_common_to_a_batch_may_be_given_once() -> None:
    flight = fly(MANOEUVRES, 10.0)
    velocity = flight.velocity_increment * np.linspace(0.99, 1.01, 3)[:, None, None]
    once = integrate(start_of(flight), flight.angle_increment, velocity, 0.01)
    each = integrate(start_of(flight), np.tile(flight.angle_increment, (3, 1, 1)), velocity, 0.01)
    np.testing.assert_array_equal(once.velocity, each.velocity)


def test_starts_may_differ() -> None:
    flight = fly(CRUISE, 10.0)
    begin = start_of(flight)
    starts = NavigationState(
        begin.latitude + np.zeros(3),
        begin.longitude + np.array([0.0, 1.0, -0.5]),
        begin.altitude + np.zeros(3),
        np.tile(begin.velocity, (3, 1)),
        np.tile(begin.attitude, (3, 1, 1)),
    )
    states = integrate(starts, flight.angle_increment, flight.velocity_increment, 0.01)
    # nothing on the Earth depends on longitude; what differs is rounding of 1e-9 m per step
    np.testing.assert_allclose(
        states.longitude - starts.longitude, flight.longitude[-1] - flight.longitude[0], atol=1e-13
    )
    np.testing.assert_allclose(states.velocity, np.tile(flight.velocity[-1], (3, 1)), atol=1e-6)


def test_free_fall_is_a_parabola_where_gravity_is_uniform() -> None:
    # no force for 2 s: in the inertial frame a body falls γ t²/2; gravitation turns by 1e-4 on the way
    begin = NavigationState(
        np.array(0.6), np.array(0.1), np.array(1e4), np.array([0.0, 300.0, 0.0]), np.eye(3)
    )
    end = integrate(begin, np.zeros((200, 3)), np.zeros((200, 3)), 0.01)
    _, velocity, position = to_inertial(begin)
    expected = position + velocity * 2.0 + earth.gravitation(position) * 2.0
    np.testing.assert_allclose(to_inertial(end, 2.0)[2], expected, atol=20.0 * 1e-4)


def test_inertial_round_trip() -> None:
    flight = fly(MANOEUVRES, 1.0)
    back = from_inertial(*to_inertial(start_of(flight), 100.0), 100.0)
    assert miss(back, flight, 0) == pytest.approx((0.0, 0.0, 0.0), abs=1e-8)


def test_compensation_is_exact_for_a_constant_rate_and_force() -> None:
    rate, force, step = np.array([10.0, -20.0, 5.0]), np.array([3.0, 50.0, -9.0]), 0.01
    readings = (np.tile((x * step)[:, None], 8) for x in (rate, force))
    theta, u = compensate(*readings)
    np.testing.assert_allclose(theta[:, 4], rate * step, rtol=1e-13)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    turned = Rotation.from_rotvec(np.outer(0.5 + 0.5 * nodes, rate * step)).as_matrix() @ force
    np.testing.assert_allclose(u[:, 4], step * 0.5 * weights @ turned, rtol=1e-12)


@pytest.mark.parametrize("samples", [1, 2, 3, 7])
def test_short_flights(samples: int) -> None:
    flight = fly(Flight(), samples * 0.01)
    assert miss(navigate(flight), flight, -1)[0] < 1e-8
