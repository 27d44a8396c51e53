"""The sources' own methods by their names, from a recording in raw codes to coefficients (A; B, tasks 1 … 7).

The recording is B's example made again: 18 positions (faces and edges), three faces turned by ± 8π on the
table, 50 Hz, readings in codes with the matrices and zeros that B prints (section 4).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner.units import STANDARD_GRAVITY_MPS2 as G
from tests.outcome import Run
from tests.specs import SHIPPED

RATE, REST_S, TURN_S = 50.0, 4.0, 2.0
S_F = np.array([[-0.0393, 0, 0], [0.0001, 0.0390, 0], [0.0001, 0.0002, 0.0385]])  # m/s² a code
B_F = np.array([19.5696, -22.4746, -20.3088])
S_W = np.array([[-0.0290, 0.0002, 0.0002], [0.0021, 0.0251, -0.0022], [0.0004, -0.0005, 0.0285]])  # deg/s
B_W = np.array([-457.6807, -400.5889, -447.4656])
ACC_SCALE, ACC_ZERO = np.array([0.04, 0.04, 0.04]), np.array([20.0, -20.0, -20.0])  # of a data sheet
GYRO_SCALE, GYRO_ZERO = np.array([0.028, 0.026, 0.028]), np.array([-450.0, -400.0, -450.0])
SIGN = np.array([-1.0, 1.0, 1.0])
MAP = """\
rate: 50 Hz
gyro: {x: -W1, y: W2, z: W3, unit: deg/s, scale: [0.028, 0.026, 0.028], zero: [-450, -400, -450]}
acc: {x: -A1, y: A2, z: A3, unit: m/s^2, scale: [0.04, 0.04, 0.04], zero: [20, -20, -20]}
"""
KNOWN = MAP + "ref_acc: {x: F1, y: F2, z: F3, unit: m/s^2}\n"
SPEC = SHIPPED / "close_the_loop.yaml"


def up(direction: np.ndarray) -> Rotation:
    """An attitude in which a body direction points up."""
    return Rotation.align_vectors([[0.0, 0.0, 1.0]], [direction])[0]


def attitudes() -> Iterator[tuple[Rotation, float]]:
    """(attitude, s until it is reached): rests on faces and edges, and whole turns on three faces."""
    faces = [s * np.eye(3)[i] for i in range(3) for s in (1.0, -1.0)]
    edges = [a + b for i, a in enumerate(faces) for b in faces[i + 1 :] if a @ b == 0]
    for k, direction in enumerate([*faces, *edges]):
        yield up(direction / np.linalg.norm(direction)), TURN_S * (1.0 + 0.1 * (k % 5))


def motion() -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) rate, rad/s, and (n, 3) specific force, m/s², in body axes."""
    rates, forces = [], []

    def turn(begin: Rotation, phi: np.ndarray, seconds: float) -> None:
        t = (np.arange(round(seconds * RATE)) + 0.5) / (seconds * RATE)
        share = t - np.sin(2 * np.pi * t) / (2 * np.pi)
        rates.append(phi * (1.0 - np.cos(2 * np.pi * t))[:, None] / seconds)
        attitude = begin * Rotation.from_rotvec(share[:, None] * phi)
        forces.append(attitude.inv().apply([0.0, 0.0, G]))

    def rest(at: Rotation) -> None:
        turn(at, np.zeros(3), REST_S)

    every = list(attitudes())
    now = every[0][0]
    rest(now)
    for attitude, seconds in every[1:]:
        turn(now, (now.inv() * attitude).as_rotvec(), seconds)
        now = attitude
        rest(now)
    for axis in np.eye(3):
        turn(now, (now.inv() * up(axis)).as_rotvec(), TURN_S)
        now = up(axis)
        rest(now)
        for sign in (1.0, -1.0):
            turn(now, sign * 8 * np.pi * axis, 16.0)
            rest(now)
    return np.concatenate(rates), np.concatenate(forces)


@pytest.fixture(scope="module", name="recording")
def _recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """In codes, whole numbers with a noise of half of one; the true force beside them, for A."""
    rng = np.random.default_rng(11)
    rate, force = motion()
    codes = np.hstack(
        [
            np.degrees(rate) @ np.linalg.inv(S_W).T + B_W,
            force @ np.linalg.inv(S_F).T + B_F,
        ]
    )
    codes = np.round(codes + 0.5 * rng.normal(size=codes.shape))
    path = tmp_path_factory.mktemp("raw") / "b.csv"
    form = ["%d"] * 6 + ["%.6f"] * 3
    np.savetxt(path, np.hstack([codes, force]), form, ",", header="W1,W2,W3,A1,A2,A3,F1,F2,F3", comments="")
    return path


def true_matrix(S: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """K of reading = K · input + bias, when the map takes codes by the data sheet."""
    return np.diag(SIGN * scale) @ np.linalg.inv(S)


@pytest.fixture(name="reduced")
def _reduced(recording: Path, run: Run) -> dict[str, Path]:
    """The recording's rests and turns, and the same with the forces that were known; reduced once."""
    found = {}
    for name, columns in (("unknown", MAP), ("known", KNOWN)):
        place = recording.parent / f"{name}.yaml"
        place.write_text(columns)
        found[name] = recording.parent / f"{name}.csv"
        if not found[name].exists():
            outcome = run("reduce", recording, "--columns", place, "-o", found[name])
            assert outcome.code == 0, outcome.err
    return found


def calibrated(tmp_path: Path, run: Run, data: Path, method: str, *more: str) -> dict:
    outcome = run("calibrate", data, "--spec", SPEC, "--method", method, "-o", "cal", *more)
    assert outcome.code == 0, outcome.err
    return json.loads((tmp_path / "cal" / "calibration.json").read_text())["sensors"]


def matrix_and_bias(sensor: dict) -> tuple[np.ndarray, np.ndarray]:
    """K and the bias in the sensor's output unit."""
    tables = sensor["tables"]
    scale = np.array([row[0] for row in tables["scale_factor"]])
    bias = np.array([row[0] for key, rows in tables.items() if key.startswith("bias_") for row in rows])
    return (1.0 + scale)[:, None] * np.array(tables["misalignment"]), bias


def test_task_1_finds_the_rests_and_the_turns(run: Run, reduced: dict[str, Path]) -> None:
    lines = [line for line in reduced["unknown"].read_text().splitlines() if line[0] != "#"]
    rows = np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding="utf-8")
    rests = rows[rows["kind"] == "rest"]
    assert len(rests) == 18 + 9
    assert rests["duration_s"].min() > 0.7 * REST_S
    outcome = run("calibrate", reduced["unknown"], "--spec", SPEC, "--method", "B1")
    assert outcome.code == 2
    assert "planner reduce" in outcome.err


@pytest.mark.parametrize("method", ["A", "B2", "B4", "B5"])
def test_accelerometers(tmp_path: Path, run: Run, reduced: dict[str, Path], method: str) -> None:
    found = calibrated(tmp_path, run, reduced["known" if method == "A" else "unknown"], method)
    K, bias = matrix_and_bias(found["accelerometer"])
    # half a code of noise over 4 s at 50 Hz is 1.4e-4 of g in a rest's mean
    np.testing.assert_allclose(K, true_matrix(S_F, ACC_SCALE), atol=4e-4)
    true_bias = SIGN * ACC_SCALE * (B_F - ACC_ZERO) / G
    np.testing.assert_allclose(bias, true_bias, atol=4e-4)
    assert "gyro" not in found
    residual = found["accelerometer"]["residual"]
    assert all(r["after"] < 0.1 * r["before"] for r in residual.values())


@pytest.mark.parametrize(("method", "within"), [("B3", 5e-4), ("B6", 1e-3)])
def test_gyros(tmp_path: Path, run: Run, reduced: dict[str, Path], method: str, within: float) -> None:
    # the data sheet's scale is up to 4 % off: of four turns no reading tells alone how many they were
    found = calibrated(tmp_path, run, reduced["unknown"], method, *["--turn", "1440"] * (method == "B3"))
    K, bias = matrix_and_bias(found["gyro"])
    np.testing.assert_allclose(K, true_matrix(S_W, GYRO_SCALE), atol=within)
    np.testing.assert_allclose(bias, SIGN * GYRO_SCALE * (B_W - GYRO_ZERO), atol=5e-3)
    assert ("accelerometer" in found) == (method == "B6")


def test_task_7_checks_gyros_on_turns_that_the_fit_has_not_seen(
    tmp_path: Path, run: Run, reduced: dict[str, Path]
) -> None:
    found = calibrated(tmp_path, run, reduced["unknown"], "B6")
    turns = found["gyro"]["residual"]["gyro_turns"]
    assert turns["held_out"]
    assert turns["rows"] >= 20
    assert turns["after"] < 0.05 * turns["before"]
    assert turns["after_in_sample"] <= turns["after"] * 1.05
    assert found["accelerometer"]["residual"]["accelerometer_modulus"]["held_out"]
