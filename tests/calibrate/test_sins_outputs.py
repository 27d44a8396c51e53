"""Calibration from attitude and velocity against the sensors' own readings, K's equations and table 4.8."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner.api.given import read
from planner.calibrate.dwells_to_fit import calibrate
from planner.calibrate.fit_options import FitOptions
from planner.calibrate.sins_outputs import dwells_of, readings
from planner.dwells.navigation_log_files import read_navigation_log
from planner.errors import InputError
from planner.nouns.navigation_log import NavigationLog
from planner.recordings.formats import reader_of
from tests.calibrate import closed_forms, sins
from tests.calibrate.sins import G0, LATITUDE, SIX, Errors, Record, U, gravity
from tests.outcome import Run

DEG = np.degrees
TABLE_4_8 = {  # K, the largest of the three axes: deg/s, %, g, %
    "gyro.bias": 0.000028,
    "gyro.scale_factor": 0.00312,
    "accelerometer.bias": 0.000095,
    "accelerometer.scale_factor": 0.000644,
}
SMALL_GYRO = Errors(np.radians([1e-3, -2e-3, 1.5e-3]), np.eye(3))
SMALL_ACC = Errors(np.array([1e-3, -2e-3, 1.5e-3]) * G0, np.eye(3))
NED_TO_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


@pytest.fixture(scope="module", name="log")
def _log(tmp_path_factory) -> NavigationLog:
    path, _ = sins.files(tmp_path_factory.mktemp("sins"))
    return read_navigation_log(path, reader_of(path), None)


def test_every_record_reads_what_its_sensors_read(log):
    for record, found in zip(sins.campaign(), log.records, strict=True):
        gyro, acc = readings(found)
        direct = sins.mean_readings(record, sins.GYRO, sins.ACCELEROMETER)
        # the log is rounded to 1e-6 deg and m/s; under load its rate, to 1e-6 deg/s, turns 8 g by 1e-6 rad
        np.testing.assert_allclose(DEG(gyro), DEG(direct[0]), atol=1e-5)
        np.testing.assert_allclose(acc / G0, direct[1] / G0, atol=1e-5)


@pytest.mark.parametrize("position", ["z_up", "y_down"])
def test_python_ins_is_turned_round_too(position):
    record = Record(position, SIX[position], seconds=10.0)
    table = _as_record(record, sins.by_python_ins(record, sins.GYRO, sins.ACCELEROMETER))
    gyro, acc = readings(table)
    direct = sins.mean_readings(record, sins.GYRO, sins.ACCELEROMETER)
    np.testing.assert_allclose(DEG(gyro), DEG(direct[0]), atol=1e-7)
    np.testing.assert_allclose(acc / G0, direct[1] / G0, atol=1e-7)


def _as_record(record: Record, log):
    from planner.nouns.navigation_log import NavigationRecord

    angles = log[["roll_deg", "pitch_deg", "heading_deg"]].to_numpy()
    velocity = log[["v_north_mps", "v_east_mps", "v_down_mps"]].to_numpy()
    time = log["time_s"].to_numpy()
    return NavigationRecord(
        "u", 1, 0.0, record.name, time, np.radians(angles), velocity, np.full(len(time), 20.0), LATITUDE,
        sins.ALTITUDE, record.rate, record.force, np.arange(len(time)),
    )  # fmt: skip


def test_direct_and_navigation_outputs_agree_to_table_4_8(log, tmp_path):
    """K 4.2.3: the same calibration from both; and both are the truth."""
    _, spec = sins.files(tmp_path)
    table = dwells_of(log)
    direct = np.array([sins.mean_readings(r, sins.GYRO, sins.ACCELEROMETER) for r in sins.campaign()])
    from dataclasses import replace

    found = [
        _coefficients(calibrate(t, read(spec).spec, FitOptions())[0])
        for t in (table, replace(table, gyro=direct[:, 0], acc=direct[:, 1]))
    ]
    for error, allowed in TABLE_4_8.items():
        for axis in "xyz":
            by_log, by_readings = (each[error, axis] for each in found)
            assert by_log == pytest.approx(by_readings, abs=allowed), (error, axis)
            assert by_log == pytest.approx(_truth(error, axis), abs=allowed), (error, axis)


def _coefficients(calibration) -> dict:
    scale = {"gyro.bias": 180 / np.pi, "accelerometer.bias": 1 / G0}
    return {
        (c.error, c.term): c.value * scale.get(c.error, 100.0)
        for sensor in calibration.sensors
        for c in sensor.coefficients
        if c.error in TABLE_4_8
    }


def _truth(error: str, axis: str) -> float:
    of = sins.GYRO if error.startswith("gyro") else sins.ACCELEROMETER
    k = "xyz".index(axis)
    if error.endswith("bias"):
        return float(DEG(of.bias[k]) if error.startswith("gyro") else of.bias[k] / G0)
    return float(100.0 * (of.matrix[k, k] - 1.0))


# ---------------------------------------------------------------- the published equations


def errors_of(record: Record, navigate=sins.navigated) -> tuple[np.ndarray, ...]:
    """t, θ = (α, β, γ), V (m, 3) east, north, up of a system with small errors, and the true C_nb."""
    log = navigate(record, SMALL_GYRO, SMALL_ACC)
    t = log["time_s"].to_numpy()
    angles = log[["heading_deg", "pitch_deg", "roll_deg"]].to_numpy()
    true = Rotation.from_matrix(record.start @ Rotation.from_rotvec(t[:, None] * record.rate).as_matrix())
    theta = (Rotation.from_euler("ZYX", angles, degrees=True) * true.inv()).as_rotvec()
    velocity = log[["v_north_mps", "v_east_mps", "v_down_mps"]].to_numpy()
    return t, theta @ NED_TO_ENU.T, velocity @ NED_TO_ENU.T, true.as_matrix()


def slope(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    return np.gradient(x, t, axis=0, edge_order=2)


@pytest.mark.parametrize("navigate", [sins.navigated, sins.by_python_ins])
def test_with_z_up_the_printed_equations_hold_and_the_sign_is_minus(navigate):
    """K eqs 24-26 and Δn_x = … − βg: two strapdown systems at rest say so; + βg is 2 βg wrong."""
    t, abc, v, _ = errors_of(Record("z_up", SIX["z_up"], seconds=10.0), navigate)
    gyro = closed_forms.sins_gyro_at_rest(abc, slope(t, abc), U, LATITUDE)
    # left out by K: what the velocity error turns the local frame, V/R = 0.2 / 6.4e6 rad/s = 2e-6 deg/s
    np.testing.assert_allclose(DEG(gyro), np.tile(DEG(SMALL_GYRO.bias), (len(t), 1)), atol=3e-6)
    acc = closed_forms.sins_accelerometers_at_rest(abc, v, slope(t, v), U, LATITUDE, gravity())["z_up"]
    np.testing.assert_allclose(acc / G0, np.tile(SMALL_ACC.bias / G0, (len(t), 1)), atol=3e-7)
    other_sign = acc[:, 0] + 2.0 * abc[:, 1] * gravity()
    assert np.abs(other_sign - SMALL_ACC.bias[0]).max() / G0 > 5e-4


@pytest.mark.parametrize("position", [p for p in SIX if p != "z_up"])
def test_in_the_other_positions_the_printed_equations_mix_two_frames(position):
    """K puts Ω and n along the sensors' axes beside V and angles along east, north, up."""
    t, abc, v, _ = errors_of(Record(position, SIX[position], seconds=10.0))
    acc = closed_forms.sins_accelerometers_at_rest(abc, v, slope(t, v), U, LATITUDE, gravity())[position]
    assert np.abs(acc - SMALL_ACC.bias).max() / G0 > 1e-4


RECORDS = {
    **{name: Record(name, c, seconds=10.0) for name, c in SIX.items()},
    **{r.name: r for r in sins.campaign() if r.name in ("x_up_+100", "y_up_-100", "z_up_+100")},
}


@pytest.mark.parametrize("name", RECORDS)
def test_along_the_sensors_axes_they_hold_in_every_position_and_turning(name):
    """Tables 2.6, 2.7: Ω and f along the sensors' axes, and everything else along them too."""
    record = RECORDS[name]
    t, abc, v, c = errors_of(record)
    to_body = np.einsum("kji,jl->kil", c, NED_TO_ENU.T)
    theta, velocity = (np.einsum("kij,kj->ki", to_body, x) for x in (abc, v))
    earth = np.einsum("kji,j->ki", c, sins.E_RATE)
    force = np.einsum("kji,j->ki", c, [0.0, 0.0, -gravity()])
    gyro, acc = closed_forms.sins_errors(
        theta, velocity, slope(t, theta), slope(t, velocity), earth, record.rate, force
    )
    inside = slice(2, -2)
    # at 100 deg/s and 10 Hz a difference misses (wh)²/6 = 5e-3 of the slope
    rough = 50.0 if np.any(record.rate) else 1.0
    np.testing.assert_allclose(DEG(gyro[inside]) - DEG(SMALL_GYRO.bias), 0.0, atol=3e-6 * rough)
    np.testing.assert_allclose((acc[inside] - SMALL_ACC.bias) / G0, 0.0, atol=3e-6 * rough)


# ---------------------------------------------------------------- the command, and what it refuses


def test_the_command_calibrates_from_a_log(run: Run, tmp_path: Path):
    log, spec = sins.files(tmp_path)
    found = run("calibrate", log, "--spec", spec, "--method", "sins_outputs", "-o", tmp_path / "out")
    assert found.code == 0
    assert "6 records at rest, 12 turning, 3 under load" in found.err
    assert (tmp_path / "out" / "calibration.json").is_file()


def test_without_the_method_a_log_says_which_one_it_needs(run: Run, tmp_path: Path):
    log, spec = sins.files(tmp_path)
    found = run("calibrate", log, "--spec", spec)
    assert found.code == 2
    assert "--method sins_outputs" in found.err


REFUSED = {
    "a column is missing": (
        lambda s: s.replace("heading_deg", "yaw", 1),
        "heading_deg: there is no such column",
    ),
    "an axis is missing": (lambda s: s.replace("table_rate_y_dps", "rate_y", 1), "beside its other axes"),
    "no latitude": (lambda s: s.replace("lat_deg", "latitude", 1), "give --latitude"),
    "a cell is no number": (lambda s: s.replace("x_up,0.100000", "x_up,", 1), "row 2"),
    "time runs back": (lambda s: s.replace("x_up,0.300000", "x_up,0.100000", 1), "time runs back"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_what_is_no_navigation_log_is_refused(fault, run: Run, tmp_path: Path):
    change, said = REFUSED[fault]
    log, spec = sins.files(tmp_path)
    log.write_text(change(sins.log_text()))
    found = run("calibrate", log, "--spec", spec, "--method", "sins_outputs")
    assert found.code == 2
    assert said in found.err


def test_samples_too_far_apart_are_refused(log):
    turning = next(r for r in log.records if r.name == "z_up_+100")
    from dataclasses import replace

    thin = slice(None, None, 15)  # 150 deg from sample to sample, and 0.4 % of scale factor
    seldom = replace(
        turning, time_s=turning.time_s[thin], attitude=turning.attitude[thin], velocity=turning.velocity[thin]
    )
    with pytest.raises(InputError, match="turns 151 deg between two samples; log at"):
        readings(seldom)
