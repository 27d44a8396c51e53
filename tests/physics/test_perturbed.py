"""Nonlinear runs of one flight with small errors, against strapdown on every sample and the linear model."""

import numpy as np
import pytest

from planner.nouns.trajectory import Trajectory
from planner.physics import earth
from planner.physics.attitude import rph_from_dcm
from planner.physics.error_dynamics import ErrorHistory, propagate_errors
from planner.physics.perturbed import navigate_with_errors
from planner.physics.strapdown import integrate
from tests.physics.flights import CRUISE, HARD, MANOEUVRES, Flight, fly
from tests.physics.test_error_dynamics import all_errors, bias_and_scale_factor
from tests.physics.test_strapdown import start_of

# what a poor MEMS unit has before calibration: 0.03 deg/s, 0.5 %, 20 mg, 0.5 %
UNCALIBRATED = np.repeat([5e-4, 5e-3, 0.2, 5e-3], 3)


def draw(runs: int, seed: int, size: float = 1.0) -> np.ndarray:
    return size * UNCALIBRATED * np.random.default_rng(seed).normal(size=(runs, 12))


def sample_by_sample(flight: Trajectory, coefficients: np.ndarray) -> np.ndarray:
    """(9, B) errors at the end by the strapdown on the perturbed readings."""
    gyro, accelerometer = (
        np.concatenate(x, axis=2) for x in bias_and_scale_factor(flight)(0, len(flight.time_s) - 1)
    )
    step = flight.time_s[1]
    angle = flight.angle_increment + step * np.einsum("nip,bp->bni", gyro, coefficients[:, :6])
    velocity = flight.velocity_increment + step * np.einsum("nip,bp->bni", accelerometer, coefficients[:, 6:])
    end = integrate(start_of(flight), angle, velocity, step)
    meridian, transverse = earth.principal_radii(flight.latitude[-1])
    true = rph_from_dcm(flight.attitude[-1])
    angles = [a - b for a, b in zip(rph_from_dcm(end.attitude), true, strict=True)]
    return np.stack(
        [
            (end.latitude - flight.latitude[-1]) * (meridian + flight.altitude[-1]),
            (end.longitude - flight.longitude[-1])
            * (transverse + flight.altitude[-1])
            * np.cos(flight.latitude[-1]),
            end.altitude - flight.altitude[-1],
            *((end.velocity - flight.velocity[-1]) * [1.0, 1.0, -1.0]).T,
            *angles,
        ]
    )


def runs_of(flight: Trajectory, coefficients: np.ndarray, **options: object) -> ErrorHistory:
    return navigate_with_errors(flight, bias_and_scale_factor(flight), coefficients, **options)


@pytest.mark.parametrize(("plan", "share"), [(MANOEUVRES, 5e-4), (CRUISE, 1e-5), (HARD, 5e-3)])
@pytest.mark.parametrize("seed", [1, 2])
def test_runs_are_those_of_the_sample_by_sample_strapdown(plan: Flight, share: float, seed: int) -> None:
    # neglected: how rotation errors of 0.5 % of 60 and of 390 deg/s change inside a block of 0.25 s
    flight, coefficients = fly(plan, 60.0), draw(6, seed)
    errors, expected = all_errors(runs_of(flight, coefficients)), sample_by_sample(flight, coefficients)
    assert np.abs(expected[:3]).max() > 100.0  # far from linear
    for rows in (slice(0, 3), slice(3, 6), slice(6, 9)):
        size = np.linalg.norm(expected[rows], axis=0)
        assert np.all(np.linalg.norm(errors[rows] - expected[rows], axis=0) < share * size + 1e-6)


def test_shorter_blocks_come_closer() -> None:
    flight, coefficients = fly(HARD, 30.0), draw(4, 3)
    expected = sample_by_sample(flight, coefficients)[:3]
    off = [
        np.abs(all_errors(runs_of(flight, coefficients, block_s=block))[:3] - expected).max()
        for block in (0.4, 0.1)
    ]
    assert off[1] < 0.5 * off[0]


def test_small_errors_are_the_linear_model() -> None:
    flight, coefficients = fly(MANOEUVRES, 60.0), draw(5, 4, size=1e-5)
    linear = all_errors(propagate_errors(flight, bias_and_scale_factor(flight))) @ coefficients.T
    errors = all_errors(runs_of(flight, coefficients))
    for rows in (slice(0, 3), slice(3, 6), slice(6, 9)):
        size = np.linalg.norm(linear[rows], axis=0)
        assert np.all(np.linalg.norm(errors[rows] - linear[rows], axis=0) < 1e-4 * size)


def test_a_batch_is_its_single_runs_and_no_error_stays_none() -> None:
    flight, coefficients = fly(CRUISE, 30.0), np.concatenate([draw(3, 5), np.zeros((1, 12))])
    batch = all_errors(runs_of(flight, coefficients))
    for k, one in enumerate(coefficients):
        np.testing.assert_allclose(
            all_errors(runs_of(flight, one[None]))[:, 0], batch[:, k], rtol=1e-7, atol=1e-8
        )
    np.testing.assert_allclose(batch[:, 3], 0.0, atol=1e-7)  # rounding of latitude times the Earth's radius


def test_instants_are_moments_of_the_same_flight() -> None:
    flight, coefficients = fly(MANOEUVRES, 40.0), draw(3, 6)
    history = runs_of(flight, coefficients, instants=[13.0, 40.0])
    assert history.time_s == pytest.approx([13.0, 40.0])
    early = runs_of(fly(MANOEUVRES, 13.0), coefficients)
    np.testing.assert_allclose(history.position[0], early.position[-1], rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(
        history.position[1], runs_of(flight, coefficients).position[-1], rtol=1e-6, atol=1e-4
    )
