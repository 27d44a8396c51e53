"""The linear combination as printed: at the end, at a time, at the worst moment."""

import numpy as np
import pytest

from planner.errors import InputError
from planner.plan.spec_to_sensitivity import sensitivities, sensitivity_rows
from planner.plan.spec_to_trajectory import trajectory_of
from tests.specs import SHIPPED

ERRORS = ["gyro.bias", "accelerometer.bias"]


@pytest.fixture(scope="module", name="found")
def _found():
    return sensitivities(trajectory_of("helicopter", SHIPPED), ERRORS, instants=[30.0])


def test_the_end_is_the_last_instant(found):
    assert {row.time_s for row in sensitivity_rows(found)} == {found.time_s[-1]}
    first = sensitivity_rows(found)[0]
    assert first.north_m == pytest.approx(found.position[-1, 0, 0] * np.pi / 180)
    assert first.roll_deg == pytest.approx(found.attitude[-1, 0, 0])  # deg per deg/s is rad per rad/s


def test_a_time_inside_the_flight(found):
    middle = sensitivity_rows(found, 30.0)
    assert {row.time_s for row in middle} == {30.0}
    # an accelerometer's bias alone is ½ t² at first: a quarter of the end's at half the time, roughly
    up = [r.up_m for r in middle if (r.error, r.axis) == ("accelerometer.bias", "z")]
    assert up[0] == pytest.approx(-0.5 * 30.0**2 * 9.80665, rel=0.01)


def test_the_worst_moment_is_no_better_than_any(found):
    for row, column in zip(sensitivity_rows(found, "any"), np.moveaxis(found.position, 2, 0), strict=True):
        worst = np.linalg.norm(column, axis=1).max()
        scale = np.pi / 180 if row.error.startswith("gyro") else 9.80665
        assert np.linalg.norm([row.north_m, row.east_m, row.up_m]) == pytest.approx(worst * scale)


def test_a_time_beyond_the_flight_is_refused(found):
    with pytest.raises(InputError, match="flight ends at 60 s"):
        sensitivity_rows(found, 61.0)
