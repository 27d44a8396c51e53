"""An error of the attitude at the start: against a nonlinear flight that begins turned, and at rest."""

from __future__ import annotations

import numpy as np
import pytest

from planner.nouns.sensor import ErrorName
from planner.nouns.trajectory import Trajectory
from planner.physics.strapdown import NavigationState, integrate
from planner.plan.flight_response import flight_response
from planner.plan.initial_attitude import by_chance, levelled, turned
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.references import InitialAlignment
from tests.specs import ROOT, loaded, small

TINY = 1e-5  # rad: squares of it are nothing
BIAS = ErrorName("accelerometer.bias")
FLIGHTS = (
    "small_uav_1",
    {"name": "level", "duration": "100 s", "heading": "40 deg"},
    {"name": "turn", "duration": "90 s"},
)


def flight(named) -> Trajectory:
    return trajectory_of(loaded(small() | {"trajectory": named}).spec.trajectory, ROOT)


def flown_from(t: Trajectory, attitude) -> NavigationState:
    start = NavigationState(t.latitude[0], t.longitude[0], t.altitude[0], t.velocity[0], attitude)
    return integrate(start, t.angle_increment, t.velocity_increment, float(t.time_s[1] - t.time_s[0]))


def skew(phi):
    x, y, z = phi
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@pytest.mark.parametrize("named", FLIGHTS, ids=["uav", "level", "turn"])
def test_it_is_what_a_flight_that_begins_turned_does(named):
    t = flight(named)
    response = turned(t, t.time_s[-1:])[0]
    right = flown_from(t, t.attitude[0])
    for k in range(3):
        wrong = flown_from(t, (np.eye(3) + TINY * skew(np.eye(3)[k])) @ t.attitude[0])
        velocity = (wrong.velocity - right.velocity) * [1.0, 1.0, -1.0] / TINY
        assert response[3:6, k] == pytest.approx(velocity, abs=2e-3 * np.linalg.norm(velocity))
        north = (wrong.latitude - right.latitude) * 6.37e6 / TINY
        assert response[0, k] == pytest.approx(north, abs=0.01 * np.linalg.norm(response[:3, k]))


def test_angles_turn_about_their_own_axes():
    """A sigma of heading alone about the vertical; of roll about the nose, of pitch about the wing."""
    t = flight({"name": "level", "duration": "20 s", "heading": "40 deg"})
    roll, pitch, heading = by_chance(t, InitialAlignment(roll_pitch="1 deg", heading="2 deg")).T
    one = np.deg2rad(1.0)
    assert heading == pytest.approx([0.0, 0.0, 2.0 * one])
    assert roll == pytest.approx(one * np.array([np.cos(np.deg2rad(40)), np.sin(np.deg2rad(40)), 0.0]))
    assert pitch == pytest.approx(one * np.array([-np.sin(np.deg2rad(40)), np.cos(np.deg2rad(40)), 0.0]))


def test_at_rest_the_tilt_of_a_self_alignment_takes_all_back_that_a_bias_does():
    """The computed specific force has no horizontal part: nothing moves, but for the turning Earth."""
    t = flight({"name": "level", "duration": "60 s", "heading": "40 deg"})
    asked = loaded(small()).spec.requirement
    alone, aligned = (
        flight_response(t, [BIAS], asked, a).errors[-1, :2].sum(axis=-1)
        for a in (None, InitialAlignment(self_aligned=True))
    )
    assert np.abs(alone[:, :2]).max() > 1000.0  # metres per m/s², ½ t²
    assert np.abs(aligned).max() < 0.01 * np.abs(alone).max()


def test_the_computed_force_of_a_levelled_unit_has_no_horizontal_part():
    t = flight("small_uav_1")
    error = np.array([[0.01], [-0.02], [0.03]])
    phi = levelled(t, error)[:, 0]
    true = np.array([0.0, 0.0, -9.8])
    computed = np.cross(phi, true) + (t.attitude[0] @ error)[:, 0]
    assert np.abs(computed[:2]).max() < 5e-3 * np.linalg.norm(error)


def test_a_gyro_does_not_level():
    t = flight("small_uav_1")
    asked = loaded(small()).spec.requirement
    one = ErrorName("gyro.bias")
    alone, aligned = (
        flight_response(t, [one], asked, a).errors for a in (None, InitialAlignment(self_aligned=True))
    )
    assert np.array_equal(alone, aligned)
