"""The linear error equations against closed forms, the nonlinear strapdown, and their own laws."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.nouns.trajectory import Trajectory
from planner.physics import earth
from planner.physics.attitude import rph_from_dcm
from planner.physics.error_dynamics import ErrorHistory, errors_at, propagate_errors
from planner.physics.strapdown import integrate
from tests.physics.flights import CRUISE, HARD, MANOEUVRES, SPIN, Curve, Flight, fly
from tests.physics.test_strapdown import start_of

G, R = 9.81, 6.37e6
Forcing = Callable[[int, int], tuple[list[np.ndarray], list[np.ndarray]]]


def diagonal(drive: np.ndarray) -> np.ndarray:
    return drive[:, :, None] * np.eye(3)


def bias_and_scale_factor(flight: Trajectory) -> Forcing:
    """Columns: gyro bias, gyro scale factor, accelerometer bias, accelerometer scale factor, each x y z."""

    def forcing(start: int, stop: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
        ones = np.ones((stop - start, 3))
        gyro, accelerometer = (
            [diagonal(ones), diagonal(x[start:stop] / flight.time_s[1])]
            for x in (flight.angle_increment, flight.velocity_increment)
        )
        return gyro, accelerometer

    return forcing


def columns(flight: Trajectory, **options: object) -> ErrorHistory:
    return propagate_errors(flight, bias_and_scale_factor(flight), **options)


def all_errors(history: ErrorHistory, k: int = -1) -> np.ndarray:
    return np.concatenate([history.position[k], history.velocity[k], history.attitude[k]])


def nonlinear_columns(flight: Trajectory) -> np.ndarray:
    """The same by central differences of one batch of 24 nonlinear runs: (9, 12)."""
    sizes = np.repeat([1e-5, 1e-5, 1e-2, 1e-3], 3)
    gyro, accelerometer = (
        np.concatenate(x, axis=2) for x in bias_and_scale_factor(flight)(0, len(flight.time_s) - 1)
    )
    step = flight.time_s[1]
    off = np.concatenate([np.diag(sizes), -np.diag(sizes)])
    angle = flight.angle_increment + step * np.einsum("nip,bp->bni", gyro, off[:, :6])
    velocity = flight.velocity_increment + step * np.einsum("nip,bp->bni", accelerometer, off[:, 6:])
    end = integrate(start_of(flight), angle, velocity, step)
    meridian, transverse = earth.principal_radii(flight.latitude[-1])
    values = np.stack(
        [
            end.latitude * (meridian + flight.altitude[-1]),
            end.longitude * (transverse + flight.altitude[-1]) * np.cos(flight.latitude[-1]),
            end.altitude,
            *(end.velocity * [1.0, 1.0, -1.0]).T,
            *rph_from_dcm(end.attitude),
        ]
    )
    return (values[:, :12] - values[:, 12:]) / (2.0 * sizes)


@pytest.mark.parametrize(
    ("plan", "duration"), [(MANOEUVRES, 60.0), (HARD, 60.0), (SPIN, 60.0), (CRUISE, 300.0)]
)
def test_every_column_is_the_derivative_of_the_nonlinear_strapdown(plan: Flight, duration: float) -> None:
    flight = fly(plan, duration)
    linear, differences = all_errors(columns(flight)), nonlinear_columns(flight)
    for rows in (slice(0, 3), slice(3, 6), slice(6, 9)):
        off = np.linalg.norm(linear[rows] - differences[rows], axis=0)
        # asked is 1e-3; rounding scatters the runs by 1e-8 m, their differences by some 1e-4
        assert np.all(off <= 2e-4 * np.linalg.norm(differences[rows], axis=0) + 1e-3 * (rows.start == 0))


# ---------------------------------------------------------------- closed forms at rest, heading north

LEVEL = fly(Flight(), 600.0)


def at(history: ErrorHistory, time: float) -> int:
    return int(np.searchsorted(history.time_s, time - 1e-9))


def test_accelerometer_bias_of_a_second_moves_by_half_b_t_squared() -> None:
    history = columns(LEVEL)
    k = at(history, 10.0)
    # Coriolis 2 Ω t/3 = 5e-4 sideways, Schuler (ωt)²/12 = 1e-5 along
    np.testing.assert_allclose(
        history.position[k, :, 6:9], 50.0 * np.diag([1.0, 1.0, -1.0]), atol=50.0 * 6e-4
    )
    np.testing.assert_allclose(np.diag(history.position[k, :, 6:9]), [50.0, 50.0, -50.0], rtol=3e-5)


def test_gyro_bias_tilts_and_then_moves_by_g_b_t_cubed_over_six() -> None:
    history = columns(LEVEL)
    k = at(history, 30.0)
    np.testing.assert_allclose(history.attitude[k, :, :3], 30.0 * np.eye(3), atol=30.0 * 3e-3)  # Ω t = 2e-3
    expected = G * 30.0**3 / 6.0
    # a roll to the right pushes the computed position east, nose up pushes it south... by -f × φ; Ω t = 2e-3
    assert history.position[k, 1, 0] == pytest.approx(expected, rel=3e-3)
    assert history.position[k, 0, 1] == pytest.approx(-expected, rel=3e-3)


def test_level_position_error_swings_with_the_schuler_period() -> None:
    history = columns(LEVEL)
    omega = np.sqrt(G / R)
    for t in (200.0, 600.0):
        expected = (1.0 - np.cos(omega * t)) / omega**2
        # the Earth's turning adds (Ω t)²/4 = 5e-4 at 600 s; g and R are rounded to 1e-3 of a 3 % effect
        assert history.position[at(history, t), 0, 6] == pytest.approx(expected, rel=1e-3)
        drift = R * (t - np.sin(omega * t) / omega)
        assert history.position[at(history, t), 1, 0] == pytest.approx(drift, rel=2e-3)


def test_vertical_position_error_runs_away() -> None:
    history = columns(LEVEL)
    omega = np.sqrt(2.0 * G / R)
    expected = (np.cosh(omega * 600.0) - 1.0) / omega**2
    assert -history.position[-1, 2, 8] == pytest.approx(expected, rel=1.5e-3)


def test_scale_factor_at_rest_is_a_bias_of_g_and_of_the_earths_rate() -> None:
    history = columns(LEVEL)
    g = float(earth.gravity(LEVEL.latitude[0], LEVEL.altitude[0]))
    rate = earth.earth_rate_ned(LEVEL.latitude[0])
    scale = history.position[-1, 2, 6:9].max()
    np.testing.assert_allclose(
        history.position[-1, :, 11], -g * history.position[-1, :, 8], atol=1e-6 * g * scale
    )
    np.testing.assert_allclose(
        history.position[-1][:, [3, 5]], history.position[-1][:, [0, 2]] * rate[[0, 2]], rtol=1e-6
    )


# ---------------------------------------------------------------- laws

SHORT = fly(MANOEUVRES, 12.0)


@settings(deadline=None, max_examples=15)
@given(st.lists(st.floats(-5.0, 5.0), min_size=12, max_size=12))
def test_superposition(coefficients: list[float]) -> None:
    c, forcing = np.array(coefficients), bias_and_scale_factor(SHORT)

    def combined(start: int, stop: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
        gyro, accelerometer = (np.concatenate(x, axis=2) for x in forcing(start, stop))
        both = [gyro @ np.stack([c[:6], 0 * c[:6]], 1), accelerometer @ np.stack([0 * c[6:], c[6:]], 1)]
        return [both[0]], [both[1]]

    history = propagate_errors(SHORT, combined)
    together = all_errors(history) @ np.array([1.0, 0.0, 0.0, 1.0])
    expected = all_errors(columns(SHORT)) @ c
    np.testing.assert_allclose(
        together, expected, rtol=1e-9, atol=1e-9 * np.abs(all_errors(columns(SHORT))).max()
    )


@pytest.mark.parametrize("shift", [1.0, -2.5])
def test_longitude_does_not_matter(shift: float) -> None:
    moved = Flight(
        **{**vars(CRUISE), "longitude": Curve(CRUISE.longitude.start + shift, CRUISE.longitude.slope)}
    )
    there, here = (all_errors(columns(fly(f, 30.0))) for f in (moved, CRUISE))
    np.testing.assert_allclose(there, here, rtol=1e-7, atol=1e-7 * np.abs(here).max())


def test_turning_the_unit_in_its_mount_permutes_the_columns() -> None:
    ahead, right = (columns(fly(Flight(heading=Curve(h)), 60.0)) for h in (0.0, np.pi / 2))
    # x now senses what y sensed and y what x sensed with the other sign
    for first in (0, 6):
        here, there = ahead.position[-1, :, first : first + 3], right.position[-1, :, first : first + 3]
        np.testing.assert_allclose(there[:, 0], here[:, 1], atol=1e-9 * np.abs(here).max())
        np.testing.assert_allclose(there[:, 1], -here[:, 0], atol=1e-9 * np.abs(here).max())


@pytest.mark.parametrize("plan", [MANOEUVRES, HARD])
def test_the_length_of_the_blocks_does_not_matter(plan: Flight) -> None:
    flight = fly(plan, 60.0)
    for coarse, fine in zip(
        all_errors(columns(flight)), all_errors(columns(flight, block_s=0.1)), strict=True
    ):
        np.testing.assert_allclose(coarse, fine, atol=2e-5 * np.abs(fine).max())


def test_instants_asked_for_are_in_the_history_and_change_nothing_else() -> None:
    flight = fly(MANOEUVRES, 60.0)
    plain, more = columns(flight), columns(flight, instants=[7.77, 60.0])
    assert len(more.time_s) == len(plain.time_s) + 1
    assert 7.77 in more.time_s.round(9)
    np.testing.assert_allclose(
        all_errors(more), all_errors(plain), rtol=1e-5, atol=1e-6 * np.abs(all_errors(plain)).max()
    )
    part = columns(fly(MANOEUVRES, 7.77))
    np.testing.assert_allclose(
        more.position[at(more, 7.77)],
        part.position[-1],
        rtol=1e-4,
        atol=1e-6 * np.abs(part.position[-1]).max(),
    )


def test_nothing_comes_from_nothing_and_the_start_is_exact() -> None:
    def silent(start: int, stop: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
        return [np.zeros((stop - start, 3, 2))], []

    assert not all_errors(propagate_errors(SHORT, silent)).any()
    assert not all_errors(columns(SHORT), 0).any()


@pytest.mark.parametrize("samples", [1, 2, 61])
def test_short_flights_have_a_history_from_start_to_end(samples: int) -> None:
    flight = fly(Flight(), samples * 0.01)
    history = columns(flight)
    np.testing.assert_allclose(history.time_s[[0, -1]], flight.time_s[[0, -1]])
    assert np.isfinite(all_errors(history)).all()


def test_columns_that_act_a_few_at_a_time_add_up_to_the_same():
    """One column for each third of the flight and axis, given where it acts, against all of them always."""
    n = len(SHORT.angle_increment)
    third = np.minimum(np.arange(n) // (n // 3), 2)

    def whole(start, stop):
        columns = np.zeros((stop - start, 3, 9))
        for i in range(3):
            columns[np.arange(stop - start), i, 3 * third[start:stop] + i] = 1.0
        return [columns], [columns]

    def active(start, stop):
        parts = np.arange(third[start], third[stop - 1] + 1)
        own = (3 * parts[:, None] + np.arange(3)).ravel()
        return np.concatenate([own, 9 + own])

    def some(start, stop):
        own = active(start, stop)
        gyro = own[own < 9]
        return [whole(start, stop)[0][0][:, :, gyro]], [whole(start, stop)[0][0][:, :, gyro]]

    instants = [float(SHORT.time_s[n // 2]), float(SHORT.time_s[-1])]
    wanted = propagate_errors(SHORT, whole, instants=instants)
    rows = [int(np.argmin(np.abs(wanted.time_s - t))) for t in instants]
    found = errors_at(SHORT, some, active, 18, instants)
    np.testing.assert_array_equal(found.time_s, wanted.time_s[rows])
    for name in ("position", "velocity", "attitude"):
        reference = getattr(wanted, name)[rows]
        np.testing.assert_allclose(getattr(found, name), reference, atol=1e-12 * np.abs(reference).max())
