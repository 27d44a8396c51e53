"""Terms that the records hardly drive stay within the budget, and a flight that drives them takes no harm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from planner.calibrate.correction import true_input
from planner.calibrate.dwells_to_fit import calibrate, fit_sensor
from planner.calibrate.fit_options import FitOptions
from planner.calibrate.fit_to_calibration import half_widths
from planner.calibrate.weak_coefficients import within_budget
from planner.nouns.dwell_table import DwellTable
from planner.spec.model import Spec
from planner.spec.sensor_alone import sensor_spec_from_bytes

DEG = np.pi / 180.0
PRODUCTS = "2e-6 s/deg"  # of two rates: 0.3 deg/s at 400 deg/s
TRUE = 1e-6 / DEG


def spec() -> Spec:
    """The gyros alone."""
    gyro = {
        "bias": {"systematic": "0.03 deg/s", "run_to_run": "0.001 deg/s"},
        "scale_factor": {"systematic": "0.5 %", "run_to_run": "0 %"},
        "misalignment": {"systematic": "0.5 deg", "run_to_run": "0 deg"},
        "cross_coupling": {"systematic": PRODUCTS, "run_to_run": "0 s/deg"},
    }
    effects = ["bias", "scale_factor", "misalignment", "cross_coupling"]
    text = yaml.safe_dump({"planner": 1, "name": "gyros", "unit": {"gyro": gyro}, "effects": effects})
    return sensor_spec_from_bytes(text.encode(), Path("gyros.yaml")).spec


def records(seed: int, rates: np.ndarray) -> DwellTable:
    """Minutes at the rates (n, 3) rad/s, eight a power-on; y = 1.002 ω + b + c ω_x ω_y, white noise."""
    rng = np.random.default_rng(seed)
    n = len(rates)
    product = TRUE * rates[:, 0] * rates[:, 1]
    y = 1.002 * rates + 0.01 * DEG + product[:, None] + 0.002 * DEG * rng.normal(size=(n, 3))
    return DwellTable(
        unit=np.full(n, "u1"),
        run=1 + np.arange(n) // 8,
        day=np.zeros(n),
        time_on=np.asarray(60.0 + 60.0 * (np.arange(n) % 8)),
        duration=np.full(n, 60.0),
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        ref_rate=rates,
        ref_acc=None,
        gyro=y,
        acc=None,
    )


def about_one_axis(seed: int) -> np.ndarray:
    """Turns about one axis at a time, the other two off by a thousandth of the rate."""
    one = np.vstack([s * w * e for e in np.eye(3) for w in (50.0, 100.0, 200.0, 400.0) for s in (1.0, -1.0)])
    twice = np.tile(one, (2, 1))
    off = 1e-3 * np.random.default_rng([seed, 1]).normal(size=twice.shape)
    return np.asarray((twice + off * np.linalg.norm(twice, axis=1)[:, None]) * DEG)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_weak_does_no_harm_where_it_is_driven(seed: int) -> None:
    (found,) = calibrate(records(seed, about_one_axis(seed)), spec(), FitOptions())
    (gyro,) = found.sensors
    status = {(c.channel, c.term): c for c in gyro.coefficients if c.error == "gyro.cross_coupling"}
    assert status["x", "xxy"].status == "weak"
    assert status["x", "xxx"].status == "determined"
    flown = records(seed + 10, 400.0 * DEG * np.random.default_rng(seed).uniform(-1.0, 1.0, (40, 3)))
    assert flown.gyro is not None
    assert flown.ref_rate is not None
    left = true_input(flown.gyro, gyro.tables, "gyro", flown.conditions()) - flown.ref_rate
    without = TRUE * np.sqrt(np.mean((flown.ref_rate[:, 0] * flown.ref_rate[:, 1]) ** 2))
    assert np.sqrt(np.mean(left**2)) < 1.5 * without


def test_the_budget_weighs_as_a_record_of_zero() -> None:
    """(C⁻¹ + Σ e eᵀ/σ²)⁻¹ and what it makes of the estimate, by dense algebra."""
    fit = fit_sensor(records(0, about_one_axis(0)), "gyro", spec())[0]
    half = half_widths(fit)
    drawn = within_budget(fit, half, spec())
    known = np.linalg.inv(fit.fit.covariance)
    prior = np.zeros(len(half))
    for i, c in enumerate(fit.model.columns()):
        if c.effect == "cross_coupling" and half[i] > 2e-6 / DEG:
            prior[i] = (1.959964 / (2e-6 / DEG)) ** 2
    assert np.count_nonzero(prior) == 3
    both = np.linalg.inv(known + np.diag(prior))
    scale = np.sqrt(np.diag(both))
    assert np.abs((drawn.fit.covariance - both) / np.outer(scale, scale)).max() < 1e-5
    linear = np.abs(drawn.theta - both @ known @ fit.theta) / scale
    assert linear[prior > 0.0].max() < 1e-5
    assert linear.max() < 1e-2  # the others are fitted anew, with their products


def test_what_contradicts_its_budget_is_not_drawn() -> None:
    """A product a hundred times its budget, known to a twentieth of itself, stays as it was found."""
    table = records(0, about_one_axis(0))
    assert table.gyro is not None
    assert table.ref_rate is not None
    strong = replace(table, gyro=table.gyro + 100.0 * TRUE * table.ref_rate[:, :1] * table.ref_rate[:, 1:2])
    fit = fit_sensor(strong, "gyro", spec())[0]
    place = [c.term for c in fit.model.columns()].index("xxy")
    half = half_widths(fit)
    assert half[place] > 2e-6 / DEG
    assert abs(fit.theta[place]) > half[place]
    assert within_budget(fit, half, spec()).theta[place] == pytest.approx(
        fit.theta[place], abs=half[place] / 2.0
    )
