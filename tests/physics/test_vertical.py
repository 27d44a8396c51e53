"""A held vertical channel: linear equations against nonlinear navigation, and what it leaves of height."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.nouns.trajectory import Trajectory
from planner.plan.spec_to_sensitivity import sensitivities
from planner.plan.spec_to_trajectory import trajectory_of
from planner.verify.recount_sensitivities import slopes_of

ERRORS = (("gyro", "bias"), ("accelerometer", "bias"), ("gyro", "scale_factor"))


def flown(name: str, duration: str, aid: float | None) -> Trajectory:
    flight = trajectory_of({"name": name, "duration": duration, "sampling_rate": "20 Hz"}, Path())
    return replace(flight, height_aid_m=aid)


@pytest.mark.parametrize(("name", "duration"), [("turn", "40 s"), ("level", "120 s")])
def test_linear_and_nonlinear_navigation_agree(name, duration):
    flight = flown(name, duration, 10.0)
    linear = sensitivities(flight, [f"{s}.{e}" for s, e in ERRORS])
    exact = slopes_of(flight, ERRORS, flight.time_s[-1:])
    for field in ("position", "velocity", "attitude"):
        one, other = getattr(linear, field)[-1], getattr(exact, field)[0]
        of_sensor = [
            np.linalg.norm(other[:, :3]),
            np.linalg.norm(other[:, 3:6]),
            np.linalg.norm(other[:, 6:]),
        ]
        apart = np.linalg.norm(one - other, axis=0).reshape(3, 3).max(axis=1)
        assert np.all(apart <= 2e-5 * np.array(of_sensor)), field


def test_height_is_held():
    flight = flown("level", "300 s", 0.0)
    found = sensitivities(flight, ["accelerometer.bias"])
    free = sensitivities(replace(flight, height_aid_m=None), ["accelerometer.bias"])
    assert np.abs(found.position[:, 2]).max() < 1e-6 * np.abs(free.position[:, 2]).max()
    assert np.abs(found.velocity[:, 2]).max() < 1e-6 * np.abs(free.velocity[:, 2]).max()
    forward, right = found.position[-1, :2, :2].T
    assert np.allclose([forward, right], free.position[-1, :2, :2].T, rtol=1e-3)


def test_without_an_aid_height_diverges():
    """δ̈h = 2 g/R δh: a bias b leaves b R/(2 g) (cosh(kt) − 1), k = √(2 g/R)."""
    flight = flown("static", "2040 s", None)
    free = sensitivities(flight, ["accelerometer.bias"]).position[-1, 2, 2]
    assert abs(free) == pytest.approx(1.755e-3**-2 * (np.cosh(1.755e-3 * 2040.0) - 1.0), rel=0.02)
