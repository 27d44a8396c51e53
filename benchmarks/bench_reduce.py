"""Reducing an hour at 1 kHz: time and peak memory, from packets, text, Parquet; and of four times as long.

Run as `python benchmarks/bench_reduce.py`. Asserted before the time: the rests and their means are those that
the stream was made with, within five sigma of their noise, and every sample is in the account.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # the map is the tests' own

from planner.dwells.dwell_files import read_dwells
from planner.readers.packets import LENGTH, PACKET, crc8
from tests.calibrate.measured_command import PACKET_MAP, measured

RATE, CYCLE, REST = 1000, 60, 50  # Hz, s: rests of 50 s, turns of 10 s
BIAS = np.array([0.01, -0.02, 0.03])  # deg/s
NOISE = 0.05  # deg/s


def stream(hours: float) -> np.ndarray:
    """Packets of an hour or more, made minute by minute."""
    rng = np.random.default_rng(1)
    parts = []
    for minute in range(round(60 * hours)):
        rows = np.zeros(RATE * CYCLE, PACKET)
        time = np.arange(len(rows)) / RATE
        rows["P"], rows["C"] = 0x1B, 1
        rows["W"] = BIAS + NOISE * rng.normal(size=(len(rows), 3))
        rows["W"][:, minute % 3] += np.where(time >= REST, 36 * (1 - np.cos(np.pi * (time - REST) / 5)), 0.0)
        rows["A"] = np.array([0, 0, 1]) + 0.002 * rng.normal(size=(len(rows), 3))
        rows["T"] = 2000
        data = rows.view("u1").reshape(len(rows), LENGTH)
        data[:, 33] = crc8(data[:, :33])
        parts.append(rows)
    return np.concatenate(parts)


def write(folder: Path, rows: np.ndarray, form: str) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq
    from pyarrow import csv

    path = folder / f"recording.{form}"
    if form == "bin":
        rows.tofile(path)
        return path
    columns = {f"{name}{i + 1}": rows[name][:, i] for name in ("W", "A") for i in range(3)} | {
        "T1": rows["T"][:, 0]
    }
    table = pa.table(columns)
    if form == "parquet":
        pq.write_table(table, path)
    else:
        csv.write_csv(table, path, csv.WriteOptions(quoting_style="none", quoting_header="none"))
    return path


def check(folder: Path, samples: int) -> int:
    """Asserts the answer; the number of rows."""
    account = json.loads((folder / "out.account.json").read_text())
    told = sum(row["samples"] + sum(row["left_out"].values()) for row in account["rows"])
    assert told + sum(part["samples"] for part in account["stretches_left_out"]) == samples
    table = read_dwells(folder / "out.csv")
    assert len(table) == samples // (RATE * CYCLE)
    assert table.n_samples is not None
    apart = np.abs(np.degrees(table.gyro) - BIAS) / (NOISE / np.sqrt(table.n_samples))[:, None]
    assert apart.max() < 5.0, apart.max()
    return len(table)


def main() -> int:
    print(f"{'format':10}{'hours':>6}{'MB':>7}{'s':>8}{'MB/s':>7}{'peak MB':>9}{'rows':>6}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "map.yaml").write_text(PACKET_MAP)
        for form, hours in (("bin", 0.25), ("bin", 1), ("bin", 4), ("bin", 8), ("parquet", 1), ("csv", 1)):
            rows = stream(hours)
            path = write(folder, rows, form)
            arguments = ["reduce", path.name, "--columns", "map.yaml", "-o", "out.csv"]
            seconds, kilobytes = measured(folder, *arguments)
            found = check(folder, len(rows))
            peak = kilobytes / 1000
            size = path.stat().st_size / 1e6
            print(
                f"{form:10}{hours:6g}{size:7.0f}{seconds:8.2f}{size / seconds:7.0f}{peak:9.0f}{found:6}",
                flush=True,
            )
            path.unlink()
    return 0


if __name__ == "__main__":
    sys.exit(main())
