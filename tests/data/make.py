"""The reduced tables of this folder, from the recordings, by our own `reduce`.

    python -m tests.data.make

Rests and the pieces of hand turns between them as `reduce` finds them; where their authors marked what is
wanted, a step column names it. Means are kept to seven digits.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from planner.dwells.dwell_files import dwells_bytes
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.recordings.column_map import ColumnMap
from planner.recordings.raw_to_dwells import reduce_recordings
from tests.data import HERE, RECORDINGS

DIGITS = 7  # a mean of a hundred samples of a 16-bit sensor has five
AXES = {"acc": {"x": 1, "y": 2, "z": 3, "unit": "m/s^2"}, "gyro": {"x": 4, "y": 5, "z": 6, "unit": "rad/s"}}
FIVE = ColumnMap.model_validate({"rate": "100 Hz", **AXES})
SIX_HZ = 102.4
THERMAL = ColumnMap.model_validate(
    {
        "unit": "sweep",
        "time": {"column": "timestamp", "unit": "us"},
        "gyro": {"x": "imu.gyro.x", "y": "imu.gyro.y", "z": "imu.gyro.z", "unit": "deg/s"},
        "acc": {"x": "imu.acc.x", "y": "imu.acc.y", "z": "imu.acc.z", "unit": "m/s^2"},
        "temperature": {"column": "imu.temperature", "unit": "degC"},
    }
)
SOURCES = {
    "five_units": "mikoff/imu-calib, data/imu{}.log; MIT, Copyright (c) 2020 Aleksandr Mikov",
    "six": "mad-lab-fau/imucal, example_data; MIT, Copyright (c) 2018 MaD-Lab Erlangen",
    "thermal": "tofupilot/examples, imu_thermal_calibration/data; MIT, Copyright (c) 2024 tofupilot",
    "campaign": "a simulator that shares nothing with planner; free",
}


# ---------------------------------------------------------------- recordings -> tables


def five_units(number: int) -> str:
    """Rests in a hand, and every turn between them in pieces."""
    path = RECORDINGS / "five_units_multi_position" / f"imu{number}.log"
    return text_of(reduce_recordings([path], FIVE).whole, SOURCES["five_units"].format(number))


def six_positions(parts: int) -> str:
    """The sections that their authors marked: six faces, each in equal parts, and three whole turns."""
    folder = RECORDINGS / "six_positions_three_rotations"
    readings = np.loadtxt(folder / "example_ferraris_session.csv", delimiter=",", skiprows=1)
    marked = json.loads((folder / "example_ferraris_session_list.json").read_text(encoding="utf-8"))
    steps = {}
    for name, section in marked.items():
        turns = name.endswith("rot")
        edges = np.linspace(section["start"], section["end"], (1 if turns else parts) + 1).astype(int)
        for k, piece in enumerate(pairwise(edges.tolist())):
            steps[f"{'turn' if turns else 'rest'}_{name}_{k}"] = piece
    found = labelled(readings[:, 4:], np.radians(readings[:, 1:4]), steps, SIX_HZ, "ferraris")
    return text_of(found, SOURCES["six"])


def thermal_sweep() -> str:
    """One rest from −18 to 74 degC, as `reduce` cuts it by temperature."""
    path = RECORDINGS / "thermal_sweep" / "imu_raw_data.csv"
    return text_of(reduce_recordings([path], THERMAL).table, SOURCES["thermal"])


def labelled(
    acc: Array, gyro: Array, steps: Mapping[str, tuple[int, int]], rate_hz: float, unit: str
) -> DwellTable:
    """The table of named stretches: acc m/s^2, gyro rad/s, (n, 3); steps: name -> samples."""
    label = np.full(len(acc), "", dtype="U16")
    for name, (begin, end) in steps.items():
        label[begin:end] = name
    columns = ColumnMap.model_validate(
        {"rate": f"{rate_hz} Hz", **AXES, "unit": unit, "step": 7, "shortest": "0.01 s"}
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{unit}.csv"
        rows = zip(np.hstack([acc, gyro]).tolist(), label.tolist(), strict=True)
        lines = [",".join([*map(repr, readings), step]) for readings, step in rows]
        path.write_text("\n".join(["ax,ay,az,gx,gy,gz,step", *lines, ""]), encoding="utf-8")
        return reduce_recordings([path], columns).table


def campaign_009() -> str:
    """Campaign 009: means over power-ons of the dwells at one rate, force and nominal temperature."""
    folder = RECORDINGS / "campaigns" / "009"
    rows = np.genfromtxt(folder / "data.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    names = [
        f"ref_{kind}" for kind in ("rate_x_dps", "rate_y_dps", "rate_z_dps", "acc_x_g", "acc_y_g", "acc_z_g")
    ]
    nominal = np.round(rows["temp_degc"] / 20.0)
    same = np.column_stack([nominal, *(rows[name] for name in names)])
    kept = ["temp_degc", *names, "gyro_x_dps", "gyro_y_dps", "gyro_z_dps"]
    _, group = np.unique(same, axis=0, return_inverse=True)
    means = [[rows[name][group.ravel() == k].mean() for name in kept] for k in range(group.max() + 1)]
    lines = [",".join(shortened(x) for x in line) for line in means]
    truth = (folder / "truth.json").read_text(encoding="utf-8").strip()
    head = [f"# source: {SOURCES['campaign']}", f"# truth: {truth}", ",".join(kept)]
    return "\n".join([*head, *lines, ""])


# ---------------------------------------------------------------- tables -> text


def text_of(found: DwellTable, source: str) -> str:
    """The CSV of `reduce`, its numbers to seven digits, its source above it."""
    lines = dwells_bytes(found).decode("utf-8").splitlines()
    body = [line if line.startswith("#") else ",".join(map(shortened, line.split(","))) for line in lines]
    return "\n".join([f"# source: {source}", "# reduced by: python -m tests.data.make", *body, ""])


def shortened(cell: object) -> str:
    """A number to seven significant digits; anything else as it is."""
    try:
        return f"{float(str(cell)):.{DIGITS}g}"
    except ValueError:
        return str(cell)


TABLES: dict[str, Callable[[], str]] = {
    **{f"imu{i}": (lambda number=i: five_units(number)) for i in range(5)},
    "six_positions": lambda: six_positions(1),
    "six_positions_in_halves": lambda: six_positions(2),
    "thermal_sweep": thermal_sweep,
    "campaign_009": campaign_009,
}


def main() -> None:
    for name, text in TABLES.items():
        (HERE / f"{name}.csv").write_text(text(), encoding="utf-8")
        print(f"{name}.csv")


if __name__ == "__main__":
    main()
