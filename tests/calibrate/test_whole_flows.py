"""Other people's recordings from their reduced tables on, each beside an independent fit by scipy.

The tables in tests/data are what `reduce` gives of the recordings (test_reduced_tables holds that); here they
are calibrated, applied and diagnosed, and scipy fits the same readings by lines of its own.
"""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_lsq_spline
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from planner.calibrate.correction import true_input
from planner.calibrate.dwells_to_fit import calibrate
from planner.calibrate.fit_options import FitOptions
from planner.dwells.table_rows import without_motions
from planner.errors import InputError
from planner.nouns.calibration import SensorCalibration
from planner.nouns.dwell_table import DwellTable
from planner.spec.model import Spec
from planner.units import STANDARD_GRAVITY_MPS2 as G
from planner.units import parse
from tests.calibrate.truths import any_spec
from tests.data import HERE
from tests.data import table as reduced
from tests.outcome import Run
from tests.specs import SHIPPED


def matrix(sensor: SensorCalibration) -> np.ndarray:
    """K (3, 3) of reading = K · input + bias."""
    return np.asarray((1.0 + sensor.tables.scale[:, 0])[:, None] * sensor.tables.misalignment)


# ---------------------------------------------------------------- hand-held units


@pytest.mark.parametrize("unit", [0, 3])
@pytest.mark.further("unit", [1, 2, 4])
def test_accelerometers_of_a_hand_held_unit_are_those_of_scipy(unit: int) -> None:
    a = reduced(f"imu{unit}", "rest_").acc

    def residual(p: np.ndarray) -> np.ndarray:
        K = np.array([[p[0], 0, 0], [p[1], p[2], 0], [p[3], p[4], p[5]]])
        return np.linalg.norm(np.linalg.solve(K, (a - p[6:]).T), axis=0) - G

    own = least_squares(residual, [1, 0, 1, 0, 0, 1, 0, 0, 0], xtol=1e-14, ftol=1e-14)
    (found,) = calibrate(reduced(f"imu{unit}"), any_spec(), FitOptions("rests_and_turns"))
    sensor = found.sensors[1]
    # the same least squares by other code: its own convergence, 1e-7 of a reading, is the difference
    np.testing.assert_allclose(matrix(sensor)[np.tril_indices(3)], own.x[[0, 1, 2, 3, 4, 5]], atol=1e-6)
    np.testing.assert_allclose(sensor.tables.bias[:, 0], own.x[6:], atol=1e-5)


@pytest.mark.parametrize("unit", [0, 3])
@pytest.mark.further("unit", [1, 2, 4])
def test_gyros_of_a_hand_held_unit_are_those_of_scipy(unit: int) -> None:
    """Gravity of one rest, turned by every piece that `reduce` kept, must be that of the next."""
    table = reduced(f"imu{unit}")
    (found,) = calibrate(table, any_spec(), FitOptions("rests_and_turns"))
    gyros, accelerometers = found.sensors
    f = true_input(table.acc, accelerometers.tables, "accelerometer", table.conditions())
    rests = np.flatnonzero(table.kind == "rest")
    turns = [(a, b) for a, b in pairwise(rests) if b > a + 1]
    assert len(turns) >= 13

    def residual(p: np.ndarray) -> np.ndarray:
        S, missed = p.reshape(3, 3), []
        for a, b in turns:
            small = (table.gyro[a + 1 : b] - table.gyro[a]) @ S.T * table.duration[a + 1 : b, None]
            direction = f[a] / np.linalg.norm(f[a])
            for matrix_ in Rotation.from_rotvec(-small).as_matrix():
                direction = matrix_ @ direction
            missed.append(direction - f[b] / np.linalg.norm(f[b]))
        return np.concatenate(missed)

    own = least_squares(residual, np.eye(3).ravel(), xtol=1e-10)
    np.testing.assert_allclose(matrix(gyros), np.linalg.inv(own.x.reshape(3, 3)), atol=2e-5)
    ours = residual(np.linalg.inv(matrix(gyros)).ravel())
    assert np.sqrt(ours @ ours / len(turns)) < 0.003  # rad: 0.17 deg, for hands and MEMS gyros


def test_free_orientations_take_the_rests_alone() -> None:
    """The pieces of hand turns in the table are no rests: with them the fit would be nonsense."""
    whole = reduced("imu0")
    assert (whole.kind == "motion").sum() > 100
    (with_motions,) = calibrate(whole, any_spec(), FitOptions("free_orientations"))
    (alone,) = calibrate(without_motions(whole), any_spec(), FitOptions("free_orientations"))
    assert with_motions.sensors[0].coefficients == alone.sensors[0].coefficients


# ---------------------------------------------------------------- chamber sweep


def test_bias_over_temperature_is_that_of_a_spline_of_scipy() -> None:
    table = reduced("thermal_sweep")
    table = replace(table, ref_rate=np.zeros((len(table), 3)), acc=None, acc_std=None)
    spec = any_spec().model_copy(update={"effects": ("bias", "bias_temperature")})
    (found,) = calibrate(table, spec)
    (gyros,) = found.sensors
    nodes = gyros.tables.temperature_degc
    order = np.argsort(table.temperature_degc)
    t, y = table.temperature_degc[order], table.gyro[order]
    left = y - np.column_stack([np.interp(t, nodes, bias) for bias in gyros.tables.bias])
    inner = nodes[1:-1]
    ends = min(nodes[0], t[0]), max(nodes[-1], t[-1])
    own = make_lsq_spline(t, y, np.r_[[ends[0]] * 2, inner, [ends[1]] * 2], k=1)
    # ours weighs records by what it found of the noise; the plain fit of lines is the least there can be
    ratio = left.std(axis=0) / (y - own(t)).std(axis=0)
    assert ratio.min() > 0.95
    assert ratio.max() < 1.15


# ---------------------------------------------------------------- six positions, three turns


def test_a_cube_is_the_closed_form_of_its_faces_and_turns() -> None:
    table = reduced("six_positions")
    (found,) = calibrate(table, any_spec(), FitOptions("cube"))
    gyros, accelerometers = found.sensors
    rest = np.char.startswith(table.step, "rest_")
    acc, faces = table.acc[rest], np.argmax(np.abs(table.acc[rest]), axis=1)
    for axis in range(3):
        up, down = (acc[(faces == axis) & (sign * acc[:, axis] > 0), axis].mean() for sign in (1, -1))
        assert accelerometers.tables.scale[axis, 0] == pytest.approx((up - down) / (2 * G) - 1, abs=2e-3)
        assert accelerometers.tables.bias[axis, 0] == pytest.approx((up + down) / 2, abs=0.02)
    bias = table.gyro[rest].mean(axis=0)
    for row in np.flatnonzero(~rest):
        turned = (table.gyro[row] - bias) * table.duration[row]
        axis = int(np.argmax(np.abs(turned)))
        assert gyros.tables.scale[axis, 0] == pytest.approx(abs(turned[axis]) / (2 * np.pi) - 1, abs=2e-3)


def test_a_cube_knows_hand_turns_that_reduce_kept() -> None:
    """A turn in many pieces is the turn in one row; one about no fixed axis is left out."""
    table = reduced("six_positions")
    pieces = in_pieces(table, 20)
    whole, cut = (calibrate(t, any_spec(), FitOptions("cube"))[0].sensors[0] for t in (table, pieces))
    np.testing.assert_allclose(whole.tables.scale, cut.tables.scale, atol=1e-9)
    np.testing.assert_allclose(whole.tables.bias, cut.tables.bias, atol=1e-9)


def turned(angle_deg: float, scale: float) -> DwellTable:
    """Six faces at rest; on every face a turn each way in 40 s, as gyros that are off by `scale` read it."""
    steps = [(face, way) for face in range(6) for way in (0, 1, -1)]
    face, way = np.array(steps).T
    up = np.where(face < 3, 1.0, -1.0)[:, None] * np.eye(3)[face % 3]
    turns = np.radians(angle_deg) / 40.0 * way[:, None] * np.eye(3)[face % 3]
    n, bias = len(steps), np.radians([0.3, -0.2, 0.1])
    noise = 1e-6 * np.random.default_rng(4).normal(size=(2, n, 3))
    return DwellTable(
        unit=np.full(n, "u1"),
        run=np.ones(n, dtype=int),
        day=np.zeros(n),
        time_on=50.0 * (1 + np.arange(n)),
        duration=np.full(n, 40.0),
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        ref_rate=None,
        ref_acc=None,
        gyro=(1.0 + scale) * turns + bias + noise[0],
        acc=G * up + noise[1],
    )


def off_by(percent: float) -> Spec:
    """A unit whose data sheet says how far the gyros' scale factor may be off."""
    spec = any_spec()
    off = {"systematic": parse(f"{percent:g} %")}
    budget = spec.unit.gyro["scale_factor"].model_copy(update=off)
    gyro = {**spec.unit.gyro, "scale_factor": budget}
    return spec.model_copy(update={"unit": spec.unit.model_copy(update={"gyro": gyro})})


@pytest.mark.parametrize(("angle", "scale"), [(360.0, 0.064), (360.0, -0.05), (90.0, 0.15), (180.0, -0.09)])
def test_one_turn_is_known_from_gyros_that_are_off(angle: float, scale: float) -> None:
    (found,) = calibrate(
        turned(angle, scale), off_by(10.0 if angle < 360.0 else 5.0), FitOptions("cube_gyros")
    )
    np.testing.assert_allclose(found.sensors[0].tables.scale[:, 0], scale, atol=1e-4)


@pytest.mark.parametrize("scale", [0.01, 0.04, 0.0641, -0.2])
def test_four_turns_are_asked_for_and_not_guessed(scale: float) -> None:
    """6.41 % of 1440 deg is 92: they would pass as 1530 deg, at 0.15 % of scale factor."""
    table, by = turned(1440.0, scale), np.radians(1440.0)
    with pytest.raises(InputError, match=r"12 turns are too long .* --turn 1440"):
        calibrate(table, off_by(5.0), FitOptions("cube_gyros"))
    if abs(scale) < 0.2:
        (found,) = calibrate(table, off_by(5.0), FitOptions("cube_gyros", turn=by))
        np.testing.assert_allclose(found.sensors[0].tables.scale[:, 0], scale, atol=1e-4)
    else:
        with pytest.raises(InputError, match="further than a fifth from --turn 1440"):
            calibrate(table, off_by(5.0), FitOptions("cube_gyros", turn=by))


def test_four_turns_are_known_from_gyros_that_the_spec_says_are_good() -> None:
    (found,) = calibrate(turned(1440.0, 0.01), off_by(2.0), FitOptions("cube_gyros"))
    np.testing.assert_allclose(found.sensors[0].tables.scale[:, 0], 0.01, atol=1e-4)
    (off,) = calibrate(turned(1440.0, 0.03), off_by(1.0), FitOptions("cube_gyros"))
    assert any("12 of them turned" in note and "--turn" in note for note in off.notes)


def in_pieces(table: DwellTable, count: int) -> DwellTable:
    """Every turn of a table as pieces of kind `motion`, whose rates differ and whose mean is the turn's."""
    turn = np.char.startswith(table.step, "turn_")
    repeats = np.where(turn, count, 1)
    rows = np.repeat(np.arange(len(table)), repeats)
    place = np.concatenate([np.arange(n) for n in repeats])
    swing = np.where(turn[rows], 1.0 + 0.5 * np.cos(2 * np.pi * (place + 0.5) / count), 1.0)
    cut = {k: v[rows] for k, v in vars(table).items() if isinstance(v, np.ndarray)}
    duration = cut["duration"] / repeats[rows]
    time = cut["time_on"] - cut["duration"] / 2 + (place + 0.5) * duration
    return replace(
        table,
        **{**cut, "duration": duration, "time_on": time, "gyro": cut["gyro"] * swing[:, None]},
        kind=np.where(turn[rows], "motion", "rest"),
    )


# ---------------------------------------------------------------- the commands, one after the other


def test_a_unit_goes_from_its_table_to_corrected_readings(tmp_path: Path, run: Run) -> None:
    data, spec = HERE / "imu0.csv", SHIPPED / "close_the_loop.yaml"
    outcome = run("calibrate", data, "--spec", spec, "--method", "rests_and_turns", "-o", "cal")
    assert outcome.code == 0, outcome.err
    outcome = run("apply", "cal", data, "-o", "corrected.csv")
    assert outcome.code == 0, outcome.err
    lines = [line for line in (tmp_path / "corrected.csv").read_text().splitlines() if line[0] != "#"]
    rows = np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding="utf-8")
    still = rows["kind"] == "rest"
    size = np.sqrt(sum(rows[f"acc_{axis}_g"] ** 2 for axis in "xyz"))[still]
    assert np.abs(size - 1).max() < 2e-3  # before, up to 0.045
    outcome = run("diagnose", data, "--spec", spec, "-o", "found", "--json")
    assert outcome.code in (0, 1), outcome.err
    assert json.loads((tmp_path / "found" / "diagnosis.json").read_text())["verdict"]


# ---------------------------------------------------------------- no empty success


@pytest.mark.parametrize(
    ("method", "data", "said"),
    [
        (
            "six_position_accelerometer",
            "imu0",
            "needs rests with every axis up, down and level, with ref_acc",
        ),
        ("triad_least_squares", "imu0", "needs rests in four orientations at least, with ref_acc"),
        ("centrifuge", "imu0", "needs three loads over 1.5 g"),
        ("nonlinearity", "imu0", "needs three rates or loads"),
    ],
)
def test_a_method_that_finds_nothing_is_no_success(
    tmp_path: Path, run: Run, method: str, data: str, said: str
) -> None:
    spec = SHIPPED / "close_the_loop.yaml"
    outcome = run(
        "calibrate", HERE / f"{data}.csv", "--spec", spec, "--method", method, "-o", "cal", "--json"
    )
    assert outcome.code == 1
    assert said in outcome.err
    assert not (tmp_path / "cal").exists()


def test_two_attitudes_say_which_rests_are_missing(tmp_path: Path, run: Run) -> None:
    lines = (HERE / "six_positions.csv").read_text().splitlines()
    kept = [line for line in lines if line[0] in "#u" or "rest_z" in line]
    (tmp_path / "two.csv").write_text("\n".join(kept) + "\n")
    spec = SHIPPED / "close_the_loop.yaml"
    outcome = run("calibrate", "two.csv", "--spec", spec, "--method", "free_orientations", "-o", "cal")
    assert outcome.code == 1
    assert "needs rests in nine attitudes" in outcome.err
    assert "rests with x up, x down, y up, y down would tell more" in outcome.err


def test_undetermined_names_the_record_that_would_determine_it() -> None:
    table = reduced("thermal_sweep")
    table = replace(table, ref_rate=np.zeros((len(table), 3)), acc=None, acc_std=None)
    spec = any_spec().model_copy(update={"effects": ("bias", "bias_temperature", "scale_factor")})
    (found,) = calibrate(table, spec)
    notes = " ".join(found.sensors[0].notes)
    for axis in "xyz":
        assert f"scale_factor.{axis} would be determined by turns about {axis} both ways" in notes
