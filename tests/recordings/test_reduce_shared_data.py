"""Recordings made by others, reduced with a map of a few lines."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from planner.dwells.dwell_files import read_dwells
from planner.recordings.column_map import ColumnMap, read_map
from planner.recordings.raw_to_dwells import reduce_recordings
from planner.units import STANDARD_GRAVITY_MPS2 as G
from tests.data import recording
from tests.outcome import Run
from tests.recordings.test_reduce import samples_told

THERMAL = """\
unit: sweep
time: {column: timestamp, unit: us}
gyro: {x: imu.gyro.x, y: imu.gyro.y, z: imu.gyro.z, unit: deg/s}
acc: {x: imu.acc.x, y: imu.acc.y, z: imu.acc.z, unit: m/s^2}
temperature: {column: imu.temperature, unit: degC}
"""
FIVE = """\
rate: 100 Hz
acc: {x: 1, y: 2, z: 3, unit: m/s^2}
gyro: {x: 4, y: 5, z: 6, unit: rad/s}
"""
SIX = """\
rate: 102.4 Hz
gyro: {x: gyr_x, y: gyr_y, z: gyr_z, unit: deg/s}
acc: {x: acc_x, y: acc_y, z: acc_z, unit: m/s^2}
"""


def map_of(tmp_path: Path, text: str) -> ColumnMap:
    (tmp_path / "map.yaml").write_text(text)
    return read_map(tmp_path / "map.yaml")


def test_the_thermal_sweep_is_one_rest_cut_by_temperature(tmp_path, run: Run):
    map_of(tmp_path, THERMAL)
    raw = recording("thermal_sweep/imu_raw_data.csv", "every sample, to hold a row to the mean of its own")
    outcome = run("reduce", raw, "--columns", "map.yaml", "-o", "data.csv", "--json")
    assert outcome.code == 0, outcome.err
    table = read_dwells(tmp_path / "data.csv")
    text = np.genfromtxt(raw, delimiter="\t", skip_header=1)
    time = (text[:, 0] - text[0, 0]) * 1e-6
    assert table.n_samples.sum() > 0.98 * len(text)
    assert table.temperature_degc.min() < -17.0
    assert table.temperature_degc.max() > 73.0
    row = len(table) // 2
    start, end = (outcome.json["rows"][row][key] for key in ("start_s", "end_s"))
    mine = text[(time >= start) & (time <= end)]
    # spikes and edge windows apart the row is the mean of the file's own numbers
    assert np.degrees(table.gyro[row]) == pytest.approx(mine[:, 1:4].mean(axis=0), abs=2e-3)
    assert table.temperature_degc[row] == pytest.approx(mine[:, 8].mean(), abs=0.1)
    slope = np.polyfit(time[(time >= start) & (time <= end)], mine[:, 8], 1)[0]
    assert table.temperature_rate[row] == pytest.approx(slope, rel=0.1)
    assert outcome.json["record_s"] is None  # the temperature moves by 90 K: no word on a dwell


@pytest.mark.parametrize("unit", range(5))
def test_five_units_have_their_sixteen_to_nineteen_rests(tmp_path, unit):
    path = recording(
        f"five_units_multi_position/imu{unit}.log", "every sample, in which rests are to be found"
    )
    found = reduce_recordings([path], map_of(tmp_path, FIVE))
    acc = found.table.acc
    # 16-18 rests by its README; a rest in which the hand slipped may count twice
    assert 16 <= len(found.rows) <= 19
    assert samples_told(found) == sum(1 for line in path.open() if line.strip())
    # |f| of an uncalibrated MPU-9150: within 5 %, and within a record 6 sigma of its 0.05 m/s^2
    assert np.abs(np.linalg.norm(acc, axis=1) / G - 1).max() < 0.05
    assert found.table.acc_std.max() < 0.3


def test_six_positions_and_three_rotations(tmp_path):
    folder = recording("six_positions_three_rotations", "every sample, in which rests are to be found")
    found = reduce_recordings([folder / "example_ferraris_session.csv"], map_of(tmp_path, SIX))
    sections = json.loads((folder / "example_ferraris_session_list.json").read_text())
    # every rest that its authors marked lies under rows of ours, and no marked rotation does
    for name, part in sections.items():
        start, end = part["start"] / 102.4, part["end"] / 102.4
        shared = sum(max(0.0, min(end, row.end) - max(start, row.start)) for row in found.rows)
        if name.endswith("rot"):
            assert shared < 0.35 * (end - start), name
        else:
            assert shared > 0.9 * (end - start), name
