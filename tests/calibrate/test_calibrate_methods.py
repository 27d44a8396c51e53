"""The methods by name: closed forms of the sources, and campaigns that plain NumPy made."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planner.calibrate.dwells_to_fit import calibrate
from planner.calibrate.fit_options import FitOptions
from planner.calibrate.methods import METHODS, fit_options
from planner.dwells.table_rows import rows_of
from planner.errors import InputError
from planner.nouns.calibration import Calibration, Coefficient
from planner.nouns.dwell_table import DwellTable
from planner.physics.earth import EARTH_RATE_RADPS as EARTH
from tests.calibrate import world
from tests.calibrate.closed_forms import rotations, six_position_accelerometer, six_position_gyro
from tests.calibrate.truths import LAYOUT, any_spec

G = world.G
DEG = np.pi / 180.0
CENTRIFUGE = world.Layout(
    temperatures=(20.0,), static_repeats=3, later=(), ramps=False, rate_temperatures=(20.0,), rate_repeats=2
)
RAMPS = world.Layout(
    temperatures=(-40.0, 0.0, 40.0),
    static_repeats=2,
    later=(),
    rate_temperatures=(-40.0, 40.0),
    rate_repeats=1,
    centrifuge=False,
)


def coefficient(found: Calibration, error: str, term: str) -> Coefficient:
    (one,) = [c for s in found.sensors for c in s.coefficients if (c.error, c.term) == (error, term)]
    return one


def by(method: str, table: DwellTable, **options: object) -> Calibration:
    (found,) = calibrate(table, any_spec(), FitOptions(method, **options))
    return found


def table(f: np.ndarray, rate: np.ndarray, acc: np.ndarray, gyro: np.ndarray) -> DwellTable:
    n = len(f)
    return DwellTable(
        unit=np.full(n, "u1"),
        run=np.ones(n, dtype=np.int64),
        day=np.zeros(n),
        time_on=60.0 * np.arange(n),
        duration=np.full(n, 30.0),
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        ref_rate=rate,
        ref_acc=f,
        gyro=gyro,
        acc=acc,
    )


# ---------------------------------------------------------------- six positions


@pytest.mark.parametrize("seed", range(4))
def test_six_positions_of_a_gyro_give_the_published_closed_form(seed: int) -> None:
    """Up, down, north, south, east, west of every axis: least squares on that design is K 2.2.2."""
    rng = np.random.default_rng(seed)
    latitude = np.radians(55.0)
    b, k = rng.normal(size=3) * 0.02 * DEG, rng.normal() * 0.01 * DEG / G
    f, rate = [], []
    for up in range(3):
        for sign in (1.0, -1.0):
            for turn in (1.0, -1.0):
                row_f, row_w = np.zeros(3), np.zeros(3)
                row_f[up], row_w[up] = sign * G, sign * EARTH * np.sin(latitude)
                row_w[(up + 1) % 3] = turn * EARTH * np.cos(latitude)
                f.append(row_f)
                rate.append(row_w)
    f, rate = np.array(f), np.array(rate)
    gyro = rate + b + 0.0
    gyro[:, 0] += k * f[:, 0]
    found = by("six_position_gyro", table(f, rate, f.copy(), gyro + 1e-9 * rng.normal(size=gyro.shape)))
    s, c = EARTH * np.sin(latitude), EARTH * np.cos(latitude)
    readings = b[0] + np.array([s + k * G, -s - k * G, c, -c, 0.0, 0.0])
    b0, kg = six_position_gyro(readings, EARTH, latitude)
    # 1e-9 rad/s of noise, so that there is something to estimate it from
    assert coefficient(found, "gyro.bias", "x").value == pytest.approx(b0, abs=2e-9)
    assert coefficient(found, "gyro.g_sensitivity", "xx").value == pytest.approx(kg / G, abs=2e-10)
    assert b0 == pytest.approx(b[0], rel=1e-9)
    assert kg == pytest.approx(k * G, rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_unequal_slopes_and_a_tilt_leave_the_accelerometer_bias(seed: int) -> None:
    rng = np.random.default_rng(seed)
    b, plus, minus = rng.normal() * 0.1, 1.0 + 0.01 * rng.normal(), 1.0 + 0.01 * rng.normal()
    tilt = np.radians(rng.uniform(-1.0, 1.0))
    f = np.array([[x * G, y * G, z * G] for x, y, z in [*np.eye(3), *-np.eye(3)]])
    read = f[:, 0] + tilt * f[:, 1]
    acc = np.where(read > 0, plus, minus) * read + b
    up, right, down, left = acc[0], acc[1], acc[3], acc[4]
    if tilt < 0:  # "right" is the side that leans up
        right, left = left, right
    assert six_position_accelerometer(down, right, up, left) == pytest.approx(b, abs=1e-4 * abs(b) + 1e-12)
    readings = np.repeat(np.column_stack([acc, f[:, 1], f[:, 2]]), 2, axis=0) + 1e-7 * rng.normal(
        size=(12, 3)
    )
    forces = np.repeat(f, 2, axis=0)
    found = by("six_position_accelerometer", table(forces, 0 * forces, readings, 0 * forces))
    assert coefficient(found, "accelerometer.bias", "x").value == pytest.approx(b, abs=1e-6)
    asymmetry = coefficient(found, "accelerometer.scale_factor_asymmetry", "x")
    assert asymmetry.value == pytest.approx(plus - minus, abs=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_turns_give_the_published_matrices(sign: float) -> None:
    """Columns of turns about x, y, z over K and ω (K 2.2.4), each way: rows of (1 + κ) M."""
    rng = np.random.default_rng(3)
    M = np.eye(3) + 0.005 * rng.normal(size=(3, 3)) * (1.0 - np.eye(3))
    kappa = 0.003 * rng.normal(size=3)
    rate = np.vstack([r * s * np.eye(3) for r in (1.0, 3.0) for s in (1.0, -1.0)] + [np.zeros((2, 3))])
    readings = (rate @ M.T) * (1.0 + kappa) + 0.01
    found = by("scale_factor_rotations", table(0 * rate + [0, 0, G], rate, 0 * rate, readings))
    scale, correction = rotations((readings - 0.01)[0 if sign > 0 else 3 :][:3].T, sign * 1.0)
    tables = found.sensors[0].tables
    ours = (1.0 + tables.scale[:, 0])[:, None] * tables.misalignment
    np.testing.assert_allclose(np.linalg.norm(ours, axis=1), scale, rtol=1e-9)  # exact data, exact answer
    np.testing.assert_allclose(np.linalg.inv(ours / scale[:, None]), correction, atol=1e-9)


# ---------------------------------------------------------------- against the independent world


@pytest.mark.parametrize(
    ("method", "hidden", "term", "unit", "layout"),
    [
        ("nonlinearity", world.Hidden("scale_factor_nonlinearity", "gyro_x", 0.02), "x", 0.01, CENTRIFUGE),
        ("nonlinearity", world.Hidden("scale_factor_asymmetry", "gyro_y", 0.02), "y", 0.01, CENTRIFUGE),
        (
            "centrifuge",
            world.Hidden("scale_factor_acceleration", "gyro_z", 0.05),
            "z",
            0.01 / 50 / G,
            CENTRIFUGE,
        ),
        ("centrifuge", world.Hidden("g_sensitivity", "gyro_x", 0.004), "xx", DEG / G, CENTRIFUGE),
        (
            "temperature_tables_with_rate",
            world.Hidden("temperature_rate", "gyro_y", 0.003),
            "y",
            DEG * 60,
            RAMPS,
        ),
    ],
    ids=lambda x: x if isinstance(x, str) else getattr(x, "effect", ""),
)
def test_a_method_finds_what_the_world_hides(
    method: str, hidden: world.Hidden, term: str, unit: float, layout: world.Layout
) -> None:
    sensor = hidden.channel.split("_")[0].replace("acc", "accelerometer")
    size = hidden.size * unit
    if hidden.effect == "scale_factor_nonlinearity":
        size *= 5.0 / 5.0 * 500.0 * DEG / (500.0 * DEG)  # 5 deg/s of 500 deg/s are 1 %
    quiet = world.Noise(gyro_run=5e-4, acc_run=2e-4)
    found = by(method, world.campaign(4, [hidden], layout, quiet))
    one = coefficient(found, f"{sensor}.{hidden.effect}", term)
    half = (one.high - one.low) / 2.0
    assert abs(one.value - size) < 2.0 * half  # 95 %: one campaign may lie a little outside, none twice
    assert half < 0.3 * abs(size)
    assert one.status == "determined"


def test_the_arm_is_fitted_and_no_reading_corrected_for_it() -> None:
    hidden = world.Hidden("arm_bending", "acc_x", 0.05)
    found = by("centrifuge", world.campaign(2, [hidden], CENTRIFUGE))
    assert any(c.error.endswith("arm_bending") for s in found.sensors for c in s.coefficients)
    assert all(e.effect != "arm_bending" for s in found.sensors for e in s.tables.extra)


def test_a_warm_up_is_found_with_its_time_constant() -> None:
    hidden = world.Hidden("warm_up", "gyro_x", 0.02, tau_s=300.0)
    found = by("temperature_tables_with_rate_and_time_on", world.campaign(3, [hidden], RAMPS))
    amplitude = coefficient(found, "gyro.warm_up", "x")
    (tau,) = [
        c
        for s in found.sensors
        for c in s.coefficients
        if c.error == "gyro.warm_up" and c.unit == "s" and c.channel == "x"
    ]
    assert tau.low < 300.0 < tau.high
    assert amplitude.low < 0.02 * DEG < amplitude.high


def test_a_time_constant_that_nothing_shows_is_held_and_said() -> None:
    """Without a warm-up its time constant is any number; it must not drag the amplitude off with it."""
    found = by("temperature_tables_with_rate_and_time_on", world.campaign(3, [], RAMPS))
    for sensor in found.sensors:
        for c in sensor.coefficients:
            if c.error.endswith("warm_up") and c.unit != "s":
                assert abs(c.value) < 0.05 * (DEG if sensor.sensor == "gyro" else G)
    assert any("held at its default, 600 s" in note for s in found.sensors for note in s.notes)


# ---------------------------------------------------------------- wrong data for a method


@pytest.mark.parametrize(
    ("method", "spoil", "says"),
    [
        ("centrifuge", lambda t: rows_of(t, np.linalg.norm(t.ref_acc, axis=1) < 1.5 * G), "three loads"),
        (
            "nonlinearity",
            lambda t: rows_of(t, np.linalg.norm(t.ref_rate, axis=1) < 1e-3),
            "three rates or loads",
        ),
        ("temperature_tables", lambda t: t, "two temperatures"),
        (
            "six_position_gyro",
            lambda t: rows_of(t, np.linalg.norm(t.ref_rate, axis=1) > 0.1),
            "rests with every",
        ),
        ("free_orientations", lambda t: replace(t, acc=None), "need acc columns"),
        ("cube", lambda t: replace(t, acc=None), "needs acc columns"),
    ],
)
def test_wrong_data_for_a_method_is_refused(method: str, spoil, says: str) -> None:
    with pytest.raises(InputError, match=says):
        by(method, spoil(world.campaign(1, [], CENTRIFUGE)))


def test_an_unknown_method_is_refused_with_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean centrifuge"):
        fit_options("centrifuges", "no", None)
    with pytest.raises(InputError, match="--robust"):
        fit_options("cube", "maybe", None)
    with pytest.raises(InputError, match="multiple of 90 deg"):
        fit_options("cube", "no", None, turn_deg=100.0)
    assert all(method.needs for method in METHODS.values())


# ---------------------------------------------------------------- robust


@cache
def fitted(outliers: float, robust: str) -> Calibration:
    """A campaign with a share of its rows far off, by a method."""
    table = world.campaign(6, [], LAYOUT, world.Noise(outliers=outliers))
    return by(method="temperature_tables", table=table, robust=robust)


@pytest.mark.parametrize("robust", ["huber", "bisquare"])
def test_outliers_are_resisted(robust: str) -> None:
    """Two rows in a hundred are 40 sigma off: the plain fit is thrown, the robust one is not."""
    best, plain, sturdy = fitted(0.0, "no"), fitted(0.02, "no"), fitted(0.02, robust)

    def off(found: Calibration) -> float:
        pairs = zip(best.sensors[0].coefficients, found.sensors[0].coefficients, strict=True)
        return float(np.sqrt(np.mean([((a.value - b.value) / a.standard_error) ** 2 for a, b in pairs])))

    assert off(sturdy) < 0.5 * off(plain)
    assert off(sturdy) < 1.0
    assert any("--robust" in note for note in plain.sensors[0].notes)


# ---------------------------------------------------------------- what the data cannot tell


def test_one_position_one_temperature_one_repeat_names_what_is_lost() -> None:
    one = rows_of(world.campaign(1, [], CENTRIFUGE), np.arange(1))
    several = rows_of(one, np.zeros(4, dtype=int))
    several = replace(
        several, time_on=10.0 * np.arange(4), acc=several.acc + 1e-5 * np.arange(12).reshape(4, 3) % 3
    )
    (found,) = calibrate(several, any_spec(), FitOptions("triad_least_squares"))
    status = {
        (c.error.split(".")[1], c.term): c.status for c in found.sensors[0].coefficients if c.channel == "x"
    }
    assert set(status.values()) == {"undetermined"}
    text = " ".join(found.sensors[0].notes)
    assert "the data cannot tell" in text
    assert "scale_factor.x" in text


def test_a_constant_channel_is_no_perfect_sensor() -> None:
    t = world.campaign(1, [], LAYOUT)
    stuck = t.gyro.copy()
    stuck[:, 1] = 0.01
    with pytest.raises(InputError, match="gyro y"):
        by("temperature_tables", replace(t, gyro=stuck))
