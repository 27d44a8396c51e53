"""A gyro that no record turns about its own axis: its scale factor is anything, its misalignments are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from planner.calibrate.dwells_to_fit import calibrate
from planner.calibrate.fit_options import FitOptions
from planner.diagnose.diagnosis_to_residual import residual_changes, unit_fits
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.dwell_table import DwellTable
from planner.spec.model import Spec
from planner.spec.sensor_alone import sensor_spec_from_bytes

DEG = np.pi / 180.0
NOISE = 0.008 * DEG
LEANS = {"xy": -0.243 * DEG, "xz": 0.281 * DEG}  # of gyro x towards y and z


def spec() -> Spec:
    """Gyros with tables of bias and scale factor."""
    gyro = {
        "bias": {"systematic": "0.5 deg/s", "run_to_run": "0.007 deg/s"},
        "scale_factor": {"systematic": "1.5 %", "run_to_run": "0.006 %"},
        "misalignment": {"systematic": "0.5 deg"},
    }
    effects = ["bias", "bias_temperature", "scale_factor", "scale_factor_temperature", "misalignment"]
    text = yaml.safe_dump({"planner": 1, "name": "gyros", "unit": {"gyro": gyro}, "effects": effects})
    return sensor_spec_from_bytes(text.encode(), Path("gyros.yaml")).spec


def records(seed: int) -> DwellTable:
    """Eighteen rests in the cold and in the heat; an arm that turns about z four times, about y twice."""
    rng = np.random.default_rng(seed)
    earth, speeds = 15.04 / 3600.0 * DEG, np.sqrt([0.0, 1.0, 1.0, 2.0, 2.0, 4.0, 4.0, 6.0, 6.0]) * 314.0 * DEG
    way = np.tile([1.0, -1.0], 5)[: len(speeds)]
    rates, degc = [], []
    for t in (-23.0, 67.0):
        up = rng.normal(size=(18, 3))
        rates.append(earth * up / np.linalg.norm(up, axis=1, keepdims=True))
        degc.append(np.full(18, t))
    for axis in (2, 2, 2, 2, 1, 1):
        rates.append(
            np.eye(3)[axis] * (way * speeds)[:, None] + earth * rng.normal(size=(len(speeds), 3)) / 2.0
        )
        degc.append(np.full(len(speeds), 22.5 + rng.normal()))
    sizes = [len(r) for r in rates]
    w, n = np.concatenate(rates), sum(sizes)
    run = np.repeat(np.arange(len(sizes)), sizes)
    lean = np.zeros((3, 3))
    lean[0, 1:] = LEANS["xy"], LEANS["xz"]
    drawn = 0.007 * DEG * rng.normal(size=(len(sizes), 3))[run]
    y = w + w @ lean.T + 0.05 * DEG + drawn + NOISE * rng.normal(size=(n, 3))
    return DwellTable(
        unit=np.full(n, "u1"),
        run=run + 1,
        day=np.zeros(n),
        time_on=np.asarray(60.0 + 60.0 * np.concatenate([np.arange(k) for k in sizes])),
        duration=np.full(n, 20.0),
        temperature_degc=np.concatenate(degc),
        temperature_rate=np.zeros(n),
        ref_rate=w,
        ref_acc=None,
        gyro=y,
        acc=None,
    )


@pytest.mark.parametrize("seed", range(3))
def test_misalignments_hold_the_truth_beside_it(seed: int) -> None:
    """By the Earth's rate it was -4; its products left 2 deg/s, and a lean 0.09 deg off was ± 0.0004."""
    (found,) = calibrate(records(seed), spec(), FitOptions())
    (gyro,) = found.sensors
    mine = {(c.error.split(".")[1], c.term): c for c in gyro.coefficients if c.channel == "x"}
    for term, size in LEANS.items():
        c = mine["misalignment", term]
        assert c.low <= size <= c.high
        assert c.high - c.low < 0.02 * DEG
        assert c.status == "determined"
    assert all(c.status == "weak" for (e, _), c in mine.items() if e == "scale_factor")
    left = next(r for r in gyro.residuals if r.channel == "x")
    assert left.in_sample < 2.0 * NOISE


@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_missing_only_where_the_residual_says_so(seed: int) -> None:
    table, one = records(seed), spec()
    found = diagnose(table, one)
    assert found.verdict == "clean"
    x = next(r for r in residual_changes(unit_fits(table, one, found)) if r.channel == "gyro_x")
    assert x.sigma_after < 1.3
    assert x.after < 2.0 * np.hypot(NOISE, 0.007 * DEG)
