"""K's table of bias over temperature and its rate (K 2.4.2, table 2.11): calibrated, applied, in the files.

The data are a few lines of interpolation by hand; none of planner's effects makes them.
"""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.calibrate.test_apply import back
from tests.outcome import Run
from tests.recordings.recordings import save

Array = NDArray[np.float64]
DEGC = np.array([-60.0, -20.0, 0.0, 20.0, 40.0, 60.0])
RATES = np.array([-2.0, 0.0, 2.0])
K_211 = np.array(  # deg/s, a row a temperature, a column a rate
    [
        [0.026, 0.023, 0.019],
        [0.014, 0.012, 0.011],
        [0.016, 0.017, 0.015],
        [0.007, 0.006, 0.006],
        [0.017, 0.019, 0.020],
        [0.028, 0.031, 0.033],
    ]
)
RUN_TO_RUN = 0.0011  # deg/s: what table 2.12 leaves at a steady temperature, by either method
AXES = np.array([1.0, -0.5, 2.0])  # the channels have the table so many times
SPEC = """\
planner: 1
name: rest in a chamber
unit:
  gyro: {bias: {systematic: 0.1 deg/s, run_to_run: 0.0011 deg/s}}
effects: [bias, bias_temperature%s]
"""
HEAD = (
    "unit,run,day,time_on_s,duration_s,temp_degc,temp_rate_degc_min,ref_rate_x_dps,ref_rate_y_dps,ref_rate_z_dps,"
    "ref_acc_x_g,ref_acc_y_g,ref_acc_z_g,gyro_x_dps,gyro_y_dps,gyro_z_dps"
)


def k_bias(degc: Array, k_min: Array, table: Array = K_211) -> Array:
    """Straight lines between K's columns, then between his rows."""
    sides = [np.array([np.interp(r, RATES, row) for r in k_min]) for row in table]
    return np.array([np.interp(t, DEGC, column) for t, column in zip(degc, np.transpose(sides), strict=True)])


def dwells(
    path: Path, seed: int, repeats: int, since: tuple[float, ...] = (600.0,), fade: float = 0.0
) -> Array:
    """Power-ons at every temperature and rate of the table: (n, 3) rate, time since power-on, bias of x.

    fade: by how much less of the rate's part is left half an hour after power-on
    """
    rng, rows, seen, run = np.random.default_rng(seed), [], [], 0
    for _ in range(repeats):
        for t in DEGC:
            for r in RATES:
                run += 1
                own = RUN_TO_RUN * rng.normal(size=3)
                for on in since:
                    still, moving = (k_bias(np.array([t]), np.array([x]))[0] for x in (0.0, r))
                    true = still + (moving - still) * (1.0 - fade * on / 1800.0)
                    gyro = AXES * true + own + 1e-4 * rng.normal(size=3)
                    rows.append([run, run * 0.01, on, 60.0, t, r, 0, 0, 0, 0, 0, 1, *gyro])
                    seen.append([r, on, gyro[0]])
    path.write_text("\n".join([HEAD, *(",".join(["u1", *map(str, row)]) for row in rows)]) + "\n")
    return np.array(seen)


def residuals(run: Run, folder: Path, effects: str, trained: str = "a.csv") -> Array:
    """(n,) what `planner apply` leaves of gyro x in power-ons that the fit has not seen, deg/s."""
    (folder / "spec.yaml").write_text(SPEC % effects)
    assert run("calibrate", trained, "--spec", "spec.yaml", "-o", "found").code == 0
    assert run("apply", "found/calibration.json", "b.csv", "-o", "c.csv").code == 0
    lines = [line for line in (folder / "c.csv").read_text().splitlines() if not line.startswith("#")]
    column = lines[0].split(",").index("gyro_x_dps")
    return np.array([float(line.split(",")[column]) for line in lines[1:]])


def rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2])
def test_k_removes_forty_per_cent_while_the_temperature_moves(tmp_path: Path, run: Run, seed: int) -> None:
    dwells(tmp_path / "a.csv", seed, repeats=10)
    (tmp_path / "soaked.csv").write_text(
        "\n".join(
            line
            for line in (tmp_path / "a.csv").read_text().splitlines()
            if line.split(",")[6] in ("temp_rate_degc_min", "0.0")
        )
    )
    rate = dwells(tmp_path / "b.csv", seed + 100, repeats=10)[:, 0]
    classic = residuals(run, tmp_path, "", "soaked.csv")
    scalar = residuals(run, tmp_path, ", temperature_rate")
    table = residuals(run, tmp_path, ", temperature_rate_table")
    for r in (-2.0, 2.0):
        assert rms(table[rate == r]) < 0.6 * rms(classic[rate == r])
    # K's table has one sign below 0 degC and the other above: no single coefficient follows it
    assert rms(scalar[rate == -2.0]) > 0.9 * rms(classic[rate == -2.0])
    assert rms(table[rate == 0.0]) == pytest.approx(rms(classic[rate == 0.0]), rel=0.1)


def test_the_nodes_are_ks_within_their_intervals(tmp_path: Path, run: Run) -> None:
    dwells(tmp_path / "a.csv", 5, repeats=20)
    (tmp_path / "spec.yaml").write_text(SPEC % ", temperature_rate_table")
    assert run("calibrate", "a.csv", "--spec", "spec.yaml", "-o", "found").code == 0
    document = json.loads((tmp_path / "found/calibration.json").read_text())
    misses = [
        (c["value"] - (K_211[i, j] - K_211[i, 1])) / c["standard_error"]
        for c in document["sensors"]["gyro"]["coefficients"]
        for i, t in enumerate(DEGC)
        for j, r in ((0, -2), (2, 2))
        if c["error"] == "gyro.temperature_rate_table" and c["term"] == f"x {t:g} degC {r:+d} K/min"
    ]
    assert len(misses) == 12
    assert max(map(abs, misses)) < 4.0
    assert 0.5 < rms(np.array(misses)) < 1.5


def test_the_table_over_time_follows_what_fades_since_power_on(tmp_path: Path, run: Run) -> None:
    dwells(tmp_path / "a.csv", 7, repeats=6, since=(30.0, 900.0, 1770.0), fade=0.8)
    rate, _, _ = dwells(tmp_path / "b.csv", 107, repeats=6, since=(30.0, 900.0, 1770.0), fade=0.8).T
    within = [
        residuals(run, tmp_path, effects)
        for effects in (", temperature_rate_table", ", temperature_rate_table_over_time")
    ]
    moving = rate != 0.0
    spread = [rms(np.ptp(x[moving].reshape(-1, 3), axis=1)) for x in within]
    assert spread[1] < 0.25 * spread[0]  # 1e-4 of noise a record are left of 1.5e-3


def test_apply_takes_the_rate_from_the_recording(tmp_path: Path, run: Run) -> None:
    """Down at 2 K/min, a rest, up at 1 K/min: K's bias goes, but for 5 s about the corners."""
    dwells(tmp_path / "a.csv", 9, repeats=20)
    (tmp_path / "spec.yaml").write_text(SPEC % ", temperature_rate_table")
    assert run("calibrate", "a.csv", "--spec", "spec.yaml", "-o", "found").code == 0
    time = np.arange(0.0, 1200.0, 0.2)
    corners = [0.0, 400.0, 700.0, 1200.0]
    degc = np.interp(time, corners, [5.0, 5.0 - 40.0 / 3.0, 5.0 - 40.0 / 3.0, 0.0])
    rate = np.select([time < 400.0, time < 700.0], [-2.0, 0.0], 1.0)
    gyro = AXES * k_bias(degc, rate)[:, None]
    shown = degc + 0.02 * np.random.default_rng(3).normal(size=len(time))  # the unit's thermometer
    acc = np.tile([0.0, 0.0, 1.0], (len(time), 1))
    save(tmp_path / "raw.csv", np.column_stack([time, gyro, acc, shown]), fmt="%.9g")
    assert run("apply", "found/calibration.json", "raw.csv", "-o", "out.csv").code == 0
    left = back(tmp_path / "out.csv")[:, 2]
    level = rms(left[(time > 420.0) & (time < 680.0)])
    for begin, end in pairwise(corners):
        inside = (time > begin + 10.0) & (time < end - 10.0)
        # a mean of 20 power-ons is off by RUN_TO_RUN/√20, a difference of two by √2 of that
        assert rms(left[inside]) < 3.0 * RUN_TO_RUN / np.sqrt(20.0), (begin, level)
    assert rms(gyro[time < 400.0, 0] - k_bias(degc, 0.0 * rate)[time < 400.0]) > RUN_TO_RUN / 2.0
