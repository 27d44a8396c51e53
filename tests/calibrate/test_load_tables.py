"""Tables over load and input against K's figures and a world of plain NumPy (K 2.2.5, 2.2.6, 3.1)."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planner.calibrate.correction import corrected
from planner.calibrate.dwells_to_fit import calibrate
from planner.calibrate.fit_options import FitOptions
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.calibration import Calibration, Coefficient
from planner.nouns.dwell_table import DwellTable
from tests.calibrate.centrifuge_to_100_g import AT_100_G, DEG, LOADS_G, G, Unit, campaign, profile
from tests.calibrate.truths import any_spec

DROOP = DEG * 0.1 / 50.0  # K 4.3.3: 0.1 deg at 50 g
SATURATING = Unit(longer=0.004, droop=DROOP, squared=4e-7)  # K figure 2.6: 0.4 % at 100 g
BETWEEN_G = (3.0, 17.0, 37.0, 60.0, 85.0)  # at no node of a table


@cache
def by(method: str, seed: int, unit: Unit) -> Calibration:
    (found,) = calibrate(campaign(seed, unit), any_spec(), FitOptions(method))
    return found


def coefficients(found: Calibration, error: str) -> list[Coefficient]:
    return [c for s in found.sensors for c in s.coefficients if c.error == error]


def left(found: Calibration, loads: tuple[float, ...]) -> np.ndarray:
    """(3, 2) deg/s that a correction leaves at most of the profile alone, on its own axis, + and −."""
    table = campaign(99, Unit(), loads, 1)
    assert table.ref_acc is not None
    force = table.ref_acc / G
    fixed = corrected(
        replace(table, gyro=profile(force, SATURATING) * DEG, acc=table.ref_acc),
        {s.sensor: s.tables for s in found.sensors},
    )
    assert fixed.gyro is not None
    off = fixed.gyro / DEG
    off = np.abs(off - off[np.abs(force).max(axis=1) <= 1.0].mean(axis=0))
    return np.array(
        [[off[sign * force[:, axis] > 1.5, axis].max() for sign in (1.0, -1.0)] for axis in range(3)]
    )


@pytest.mark.parametrize("seed", [1])
def test_of_a_profile_that_saturates_a_table_leaves_what_k_leaves_and_lines_do_not(seed: int) -> None:
    """K table 2.5: .08-.12 deg/s become .011-.017, five to ten times less."""
    lines, table = by("centrifuge", seed, SATURATING), by("load_tables", seed, SATURATING)
    for loads in (LOADS_G, BETWEEN_G):
        assert (left(table, loads) < AT_100_G / 10.0).all()
        assert (left(lines, loads) > AT_100_G / 5.0).any()


@pytest.mark.parametrize("seed", [1])
def test_the_arm_s_length_and_its_bending_are_estimated_together(seed: int) -> None:
    """K_R by gravity and rotation beside the droop of the arm; the scale factor under load as it is."""
    found = by("load_tables", seed, SATURATING)
    (length,) = {(c.value, c.high - c.low) for c in coefficients(found, "accelerometer.arm_length")}
    assert abs(length[0] - 0.004) < length[1] < 1e-4
    for sensor in ("gyro", "accelerometer"):
        droop = [c for c in coefficients(found, f"{sensor}.arm_bending") if c.term == "arm"]
        # a tilt is a rotation: the second order of .2 deg is .5 % of it
        assert [c.value for c in droop] == pytest.approx([DROOP / G] * 3, rel=5e-3)
    for c in coefficients(found, "gyro.scale_factor_acceleration_squared"):
        # per g² of the load that is asked, 1 / K_R² of which is felt
        assert c.value * G**2 == pytest.approx(4e-7 * 1.004**2, rel=2e-3)


def test_the_diagnosis_names_the_table_and_the_arm() -> None:
    found = diagnose(campaign(3, Unit(longer=0.004), repeats=1), any_spec())
    assert {e.effect for e in found.effects} == {"load_curve", "arm_length"}


def test_without_high_loads_a_table_is_no_hypothesis() -> None:
    table = campaign(4, Unit(), loads=(1.0, 2.0, 4.0, 8.0), repeats=1)
    found = diagnose(table, any_spec())
    assert "load_curve" in {u.effect for u in found.untestable}


# ---------------------------------------------------------------- over rates


RATES_DPS = np.array([10.0, 25.0, 50.0, 100.0, 200.0, 300.0, 400.0, 500.0])  # K table 2.4
KAPPA_PLUS = np.array([0.4, 0.25, 0.3, 0.2, 0.12, 0.05, 0.02, 0.0]) * 1e-2
KAPPA_MINUS = np.array([-0.3, -0.25, -0.1, 0.05, 0.1, 0.1, 0.05, 0.0]) * 1e-2
OF_AXIS = np.array([1.0, -0.6, 0.4])  # what all gyros had in common would be the table's


def bent(rate: np.ndarray) -> np.ndarray:
    """deg/s that the tables above add."""
    size = np.abs(rate)
    kappa = np.where(
        rate > 0.0, np.interp(size, RATES_DPS, KAPPA_PLUS), np.interp(size, RATES_DPS, KAPPA_MINUS)
    )
    return kappa * rate * OF_AXIS


def turns(seed: int, rates: np.ndarray, noise: float = 1e-3) -> DwellTable:
    """Turns about every axis, both ways, and rests, in three power-ons."""
    rng = np.random.default_rng([seed, 500])
    rows = [
        (run, axis, sign * rate)
        for run in range(3)
        for axis in range(3)
        for rate in (0.0, *rates)
        for sign in (1.0, -1.0)
    ]
    n = len(rows)
    rate, force = np.zeros((n, 3)), np.zeros((n, 3))
    run = np.array([r for r, _, _ in rows])
    for i, (_, axis, value) in enumerate(rows):
        rate[i, axis], force[i, axis] = value, 1.0
    gyro = rate * (1.0 + np.array([0.002, -0.001, 0.003])) + bent(rate) + 0.01
    gyro += 1e-3 * rng.normal(size=(3, 3))[run] + noise * rng.normal(size=(n, 3))
    return DwellTable(
        unit=np.full(n, "u1"),
        run=run,
        day=0.05 * run,
        time_on=60.0 + 30.0 * (np.arange(n) % (n // 3)),
        duration=np.full(n, 20.0),
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        ref_rate=np.radians(rate),
        ref_acc=force * G,
        gyro=np.radians(gyro),
        acc=(force + 1e-4 * rng.normal(size=(n, 3))) * G,
    )


def test_a_table_over_eight_rates_follows_each_side_and_a_cubic_does_not() -> None:
    data, fresh = turns(1, RATES_DPS), turns(9, np.array([15.0, 80.0, 250.0, 450.0]), noise=0.0)
    most = {}
    for method in ("nonlinearity", "nonlinearity_table"):
        (found,) = calibrate(data, any_spec(), FitOptions(method))
        fixed = corrected(fresh, {s.sensor: s.tables for s in found.sensors})
        assert fixed.gyro is not None
        assert fresh.ref_rate is not None
        off = (fixed.gyro - fresh.ref_rate) / DEG
        rest = np.abs(fresh.ref_rate).max(axis=1) == 0.0
        most[method] = float(np.abs(off - off[rest].mean(axis=0)).max())
    # the largest nonlinearity is .3 deg/s; what scatters from power-on to power-on is .001 deg/s
    assert most["nonlinearity_table"] < 0.006
    assert most["nonlinearity"] > 5.0 * most["nonlinearity_table"]


def test_a_polynomial_of_each_sign_finds_both_and_its_correction_takes_them_out() -> None:
    """.3 % x for +, −.2 % x² for −, on gyro x: truth from two lines of numpy."""
    plain, size = turns(3, RATES_DPS, noise=0.0), 500.0 * DEG
    assert plain.ref_rate is not None
    assert plain.gyro is not None
    u = plain.ref_rate[:, 0]
    x = np.maximum(np.abs(u) / size - 1.0 / 500.0, 0.0)
    bent = np.where(u > 0.0, 0.003 * x, -0.002 * x**2) * u
    straight = plain.ref_rate + np.column_stack([bent, 0.0 * u, 0.0 * u])
    rng = np.random.default_rng(3)
    data = replace(plain, gyro=straight + 1e-4 * DEG * rng.normal(size=straight.shape))
    (found,) = calibrate(data, any_spec(), FitOptions("nonlinearity_polynomial"))
    told = {c.term: c.value for c in coefficients(found, "gyro.scale_factor_polynomial")}
    expected = {"x +1": 0.003, "x -2": -0.002}
    for term, value in told.items():
        assert value == pytest.approx(expected.get(term, 0.0), abs=3e-5), term
    fixed = corrected(data, {s.sensor: s.tables for s in found.sensors})
    assert fixed.gyro is not None
    assert np.abs(fixed.gyro - plain.ref_rate).max() < 2e-3 * DEG < 1e-2 * np.abs(bent).max()


def test_the_table_over_rates_is_k_s_nonlinearity_from_the_end_of_the_range() -> None:
    """κ_k = (K_end − K_k)/K_end at the eight rates, from the coefficients of the fit."""
    (found,) = calibrate(turns(2, RATES_DPS), any_spec(), FitOptions("nonlinearity_table"))
    rises = {
        (c.term[0], "+" in c.term): [
            o.value
            for o in coefficients(found, "gyro.scale_factor_curve")
            if (o.term[0], "+" in o.term) == (c.term[0], "+" in c.term)
        ]
        for c in coefficients(found, "gyro.scale_factor_curve")
    }
    for (axis, plus), own in rises.items():
        kappa = np.cumsum(own[::-1])[::-1]
        truth = OF_AXIS["xyz".index(axis)] * (KAPPA_PLUS if plus else KAPPA_MINUS)[:-1]
        # .001 deg/s of noise at the slowest rate, 10 deg/s, over three power-ons
        np.testing.assert_allclose(kappa[1:], truth[1:], atol=2e-4)
