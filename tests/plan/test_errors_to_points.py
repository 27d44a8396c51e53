"""Temperature points: how many, which ones, what they leave."""

import numpy as np
import pytest

from planner.errors import InputError
from planner.plan.errors_to_points import point_menus
from planner.spec.even_points import even_points
from tests.specs import loaded, planned, shared, small, with_limit, with_plan


def menus(spec: dict) -> dict:
    return {(m.error, m.test): m.points for m in point_menus(loaded(spec).spec)}


def test_even_points_hold_both_ends_and_share_their_common_temperatures():
    assert even_points(-60, 60, 1) == (0,)
    assert even_points(-60, 60, 5) == (-60, -30, 0, 30, 60)
    assert set(even_points(-60, 60, 3)) <= set(even_points(-60, 60, 7)) & set(even_points(-60, 60, 5))


def test_residuals_are_those_of_the_table():
    points = menus(small())["gyro.bias", "gyro_drift"]
    per_degree = np.pi / 180
    assert [len(p.temperatures_degc) for p in points] == [1, 3, 5]
    assert [p.residual for p in points] == pytest.approx(
        [0.032 * per_degree, 0.0085 * per_degree, 0.0035 * per_degree]
    )


def test_numbers_between_the_tabulated_ones_need_permission():
    temperatures = {"range": ["-60 degC", "60 degC"], "candidates": [1, 4, 5]}
    assert [
        len(p.temperatures_degc)
        for p in menus(with_plan(small(), temperatures=temperatures))["gyro.bias", "gyro_drift"]
    ] == [1, 5]
    allowed = menus(with_plan(small(), temperatures=temperatures | {"interpolate": True}))
    points = allowed["gyro.bias", "gyro_drift"]
    assert [len(p.temperatures_degc) for p in points] == [1, 4, 5]
    # halfway between three points (0.0085) and five (0.0035)
    assert points[1].residual == pytest.approx(0.006 * np.pi / 180)


def test_no_usable_number_is_refused():
    with pytest.raises(InputError, match=r"candidates|residual"):
        menus(with_plan(small(), temperatures={"range": ["-60 degC", "60 degC"], "candidates": [4]}))


def test_without_the_temperature_effect_one_point_is_all_there_is_and_the_variation_stays():
    spec = small(effects=["bias"])
    points = menus(spec)["gyro.bias", "gyro_drift"]
    assert {len(p.temperatures_degc) for p in points} == {1}
    assert [p.residual for p in points] == pytest.approx([0.032 * np.pi / 180] * len(points))
    plan = planned(with_limit(spec, "60 m")).plan
    part = next(a for a in plan.allowances if a.error == "gyro.bias").temperature
    assert part == pytest.approx(0.032 * np.pi / 180)


def measured_curve() -> dict:
    """A bias that bends once, at 20 degC, and is straight elsewhere: three points leave nothing."""
    spec = small()
    curve = {
        t: 0.02 - 0.0002 * (t + 60) if t <= 20 else 0.004 + 0.0005 * (t - 20) for t in range(-60, 61, 10)
    }
    table = {"curve": {f"{t} degC": f"{value:.6f} deg/s" for t, value in curve.items()}}
    bias = spec["unit"]["gyro"]["bias"] | {"temperature_residual": table}
    spec["unit"] = spec["unit"] | {"gyro": {"bias": bias}}
    return spec


def test_a_measured_curve_says_which_temperatures_to_take():
    points = {
        (p.placement, len(p.temperatures_degc)): p for p in menus(measured_curve())["gyro.bias", "gyro_drift"]
    }
    assert points["optimal", 3].temperatures_degc == (-60, 20, 60)
    assert points["optimal", 3].residual == pytest.approx(0, abs=1e-12)
    assert points["even", 3].residual > 1e-5
    plan = planned(measured_curve()).plan
    (drift,) = [test for test in plan.tests if test.test == "gyro_drift"]
    assert drift.temperatures_degc == (-60, 20, 60)


def test_an_error_without_a_residual_rides_along():
    spec = shared()
    spec["unit"]["gyro"]["misalignment"] = {"systematic": "0.5 deg", "run_to_run": "0.003 deg"}
    spec["effects"] = [*spec["effects"], "misalignment"]
    spec["sensitivities"] = {"given": spec["sensitivities"]["given"] | {"gyro.misalignment": "10 m/deg"}}
    spec["tests"]["static"]["calibrates"] = ["gyro.bias", "accelerometer.bias", "gyro.misalignment"]
    without, riding = planned(with_limit(shared(), "11 m")).plan, planned(with_limit(spec, "11.1 m")).plan
    assert riding.time_s == without.time_s


def test_an_error_that_no_test_serves_stays_whole_and_is_named():
    spec = small()
    spec["tests"] = {"gyro_drift": spec["tests"]["gyro_drift"]}
    made = planned(with_limit(spec, "40 m")).plan
    left = next(a for a in made.allowances if a.error == "accelerometer.bias")
    assert not left.calibrated
    # systematic 0.02 g, but one point leaves 0.024 g: the larger one; with 0.0025 g of random parts
    assert left.allowed == pytest.approx((0.024 + 0.0025) * 9.80665)
    assert any("accelerometer.bias" in note and "whole" in note for note in made.notes), made.notes
