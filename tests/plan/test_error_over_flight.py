"""The error over the time of flight against closed forms and the plan's own figure."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from planner.plan.error_over_flight import SHARED, error_over_flight, planned_sizes
from planner.plan.flights_side_by_side import side_by_side
from planner.plan.spec_to_sensitivity import sensitivities
from planner.plan.spec_to_trajectory import trajectory_of
from tests.specs import SHIPPED, planned

G = 9.80665
ERRORS = ["gyro.bias", "accelerometer.bias", "accelerometer.scale_factor"]


@pytest.fixture(scope="module", name="at_rest")
def _at_rest():
    """A minute on a level floor, heading north: everything has a closed form in powers of t."""
    still = {"name": "static", "duration": "60 s", "latitude": "0 deg", "sampling_rate": "20 Hz"}
    return sensitivities(trajectory_of(still, Path()), ERRORS)


def test_at_rest_the_curves_are_powers_of_time(at_rest):
    sizes = {"gyro.bias": np.radians(0.001), "accelerometer.bias": 0.001 * G}
    found = error_over_flight(at_rest, sizes, "position", adds=True)
    t = found.time_s
    # Schuler takes (60 s / 806 s)² / 12 = 5e-4 away, of the vertical twice; the rotation of the Earth 1e-5
    np.testing.assert_allclose(found.by_error["accelerometer.bias"], 3 * 0.001 * G * t**2 / 2, rtol=2e-3)
    # a tilt ωt under gravity: g ω t³/6 of x and y; a turn about the vertical moves nothing at rest
    np.testing.assert_allclose(
        found.by_error["gyro.bias"][t > 1], 2 * np.radians(0.001) * G * t[t > 1] ** 3 / 6, rtol=6e-3
    )
    np.testing.assert_allclose(sum(found.by_axis.values()), found.total, rtol=1e-12)
    np.testing.assert_allclose(sum(found.by_error.values()), found.total, rtol=1e-12)
    assert found.by_axis["x"][-1] == pytest.approx(found.by_axis["y"][-1], rel=1e-3)
    assert found.by_axis["z"][-1] == pytest.approx(0.001 * G * 1800, rel=2e-3)  # the accelerometer alone


def test_squares_add_where_the_rule_says_so(at_rest):
    sizes = {"gyro.bias": np.radians(0.001), "accelerometer.bias": 0.001 * G}
    found = error_over_flight(at_rest, sizes, "horizontal", adds=False)
    squares = sum(curve**2 for curve in found.by_axis.values())
    np.testing.assert_allclose(found.total**2, squares, rtol=1e-12)


def test_the_curves_end_at_the_instant_asked_for(at_rest):
    whole = error_over_flight(at_rest, {"gyro.bias": 1.0}, "attitude", adds=True)
    half = error_over_flight(at_rest, {"gyro.bias": 1.0}, "attitude", adds=True, until=30.0)
    assert half.time_s[-1] == 30.0
    assert half.total[-1] == whole.total[whole.time_s == 30.0]
    assert list(whole.by_error) == ["gyro.bias"]  # what has no size has no curve


def test_terms_of_several_channels_are_no_axis():
    from planner.nouns.sensitivities import SensitivityColumn
    from planner.plan.error_over_flight import axis_of

    assert axis_of(SensitivityColumn("gyro.misalignment", "yz", "deg")) == "y"
    assert axis_of(SensitivityColumn("accelerometer.scale_factor", "z", "1")) == "z"
    assert SHARED not in ("x", "y", "z")


@pytest.mark.parametrize("rule", ["worst_case", {"percentile": "95 %"}])
def test_at_the_requirements_instant_the_curves_are_the_plans_figure(rule):
    document = yaml.safe_load((SHIPPED / "small_uav_worst_case.yaml").read_text())
    document["trajectory"] = {"name": "static", "duration": "20 s"}
    document["requirement"] = [{"error": "position", "limit": "100 m", "rule": rule, "at": "15 s"}]
    document["plan"] = {
        "method": "published",
        "repeats": {"least": 2, "most": 30},
        "genetic": {"generations": 1},
    }
    made = planned(document)
    (achieved,), (binding,) = made.plan.requirements, made.navigation.constraints
    sizes = planned_sizes(achieved, binding)
    adds = rule == "worst_case"
    found = error_over_flight(
        made.navigation.sensitivities, sizes, "position", adds=adds, until=binding.time_s
    )
    assert found.time_s[-1] == pytest.approx(15.0, abs=0.02)
    assert found.total[-1] == pytest.approx(achieved.achieved, rel=1e-9)
    if adds:
        allowed = {a.error: a.allowed for a in made.plan.allowances}
        assert sizes == pytest.approx(allowed, rel=1e-9)


def test_published_ratios_between_trajectories_and_what_does_not_reproduce():
    """K table 3.1, small UAV 1 : helicopter : small UAV 2, one minute."""
    flights = {
        n: sensitivities(trajectory_of(n, SHIPPED), [*ERRORS, "gyro.scale_factor"])
        for n in ("small_uav_1", "helicopter", "small_uav_2")
    }
    _, helicopter, second = side_by_side(flights)
    # reproduced: an accelerometer's bias costs the same on every flight (K 1.248, 1.246, 1.245) but for
    # the turns of the unit, which average it out; its scale factor twice as much under 80 g (K 8.133 / 4.006)
    assert helicopter.ratio["accelerometer.bias"] == pytest.approx(1.248 / 1.245, abs=0.12)
    assert second.ratio["accelerometer.bias"] == pytest.approx(1.246 / 1.245, abs=0.02)
    assert second.ratio["accelerometer.scale_factor"] == pytest.approx(8.133 / 4.006, rel=0.25)
    # not reproduced, K: 27.8, 2.17; 0.327, 0.026, 0.021. Only the order of the two small UAVs is the same
    assert second.ratio["gyro.bias"] > 5
    assert second.ratio["gyro.scale_factor"] > 2.17
    assert helicopter.ratio["gyro.bias"] > 1
