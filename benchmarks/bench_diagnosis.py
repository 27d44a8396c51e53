"""Seconds of a search at 500, 4 000 and 8 000 dwells; of the whole command at 4 000 and a million.

Verdicts come first, of 4 000 dwells also where nothing hides. Of the command processor seconds and memory,
imports and report page with them.

Run: OMP_NUM_THREADS=1 python benchmarks/bench_diagnosis.py
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from planner.dwells.dwell_files import write_dwells
from planner.dwells.table_rows import rows_of
from planner.nouns.dwell_table import DwellTable
from tests.calibrate.world import Hidden, Layout, Noise, campaign
from tests.diagnose.worlds import DECLARED, SPEC, named

HIDES = (Hidden("temperature_rate", "gyro_z", 0.004),)


def table_of(rows: int, hides: Sequence[Hidden] = HIDES) -> DwellTable:
    """A campaign of at least that many rows in which gyro z feels the temperature's rate, or nothing."""
    repeats = max(1, -(-(rows - 258) // 192))  # as many rows a repeat, and as many that come once
    layout = Layout(static_repeats=repeats, rate_repeats=repeats, later=(30.0, 60.0))
    table = campaign(3, hides, layout)
    keep = np.isin(table.run, np.unique(table.run)[:: max(1, len(table) // rows)])
    return table if rows > 600 else rows_of(table, keep)


def searched(table: DwellTable) -> tuple[float, SensorFound]:
    """Seconds, and what was found on the gyros."""
    start = time.perf_counter()
    found = diagnose_sensor(prepared(replace(table, acc=None)), "gyro", DECLARED, 1)
    return time.perf_counter() - start, found


def main() -> None:
    before: tuple[int, float] | None = None
    for rows in (500, 4_000, 8_000):
        table = table_of(rows)
        seconds, found = searched(table)
        assert named(found.found) == {("temperature_rate", "z")}, named(found.found)
        growth = ""
        if before is not None:
            power = np.log(seconds / before[1]) / np.log(len(table) / before[0])
            growth = f", grows as n^{power:.2f}"
        print(f"{len(table):6d} dwells: {seconds / 3:6.2f} s a channel{growth}")
        before = len(table), seconds
    four = table_of(4_000)
    small = command(four, "four_thousand.csv")
    print(f"planner diagnose, {len(four)} dwells on six channels: {small[0]:.1f} s, {small[1]:.0f} MB")
    clean = command(table_of(4_000, ()), "clean.csv", hides=False)
    print(f"the same where nothing hides: {clean[0]:.1f} s, {clean[0] / small[0]:.2f} of that")
    large = command(million(), "million.parquet")
    print(f"planner diagnose, 1 000 000 dwells: {large[0]:.1f} s, {large[1]:.0f} MB")
    print(f"250 times the dwells: {large[0] / small[0]:.1f} times the seconds")


def million() -> DwellTable:
    """A campaign over and over, every power-on and record with noise of its own; gyro z feels the ramps."""
    quiet = Noise(gyro=1e-9, acc=1e-9, gyro_run=1e-9, acc_run=1e-9, scale_run=1e-9, rate=1e-9)
    layout = Layout(static_repeats=24, rate_repeats=24, later=(30.0, 60.0))
    once = campaign(3, HIDES, layout, noise=quiet)
    rng, n = np.random.default_rng(5), 1_000_000
    row, copy = np.arange(n) % len(once), np.arange(n) // len(once)
    table = rows_of(once, row)
    run = table.run + copy * (int(once.run.max()) + 1)
    runs = int(run.max()) + 1

    def noisy(y: np.ndarray, u: np.ndarray, record: float, level: float) -> np.ndarray:
        drawn = rng.normal(0.0, level, (runs, 3))[run] + u * rng.normal(0.0, 1e-5, (runs, 3))[run]
        return y + drawn + rng.normal(0.0, record, (n, 3)) + u * rng.normal(0.0, 1.5e-5, (n, 3))

    measured = table.gyro, table.ref_rate, table.acc, table.ref_acc
    gyro, rate, acc, force = (y for y in measured if y is not None)
    gyro = noisy(gyro, rate, np.radians(1.1e-3), np.radians(2e-3))
    return replace(table, run=run, gyro=gyro, acc=noisy(acc, force, 5e-4, 8e-3))


def command(table: DwellTable, name: str, hides: bool = True) -> tuple[float, float]:
    """Processor seconds and peak MB of `planner diagnose` in a process of its own, one thread."""
    with tempfile.TemporaryDirectory() as folder:
        spec, data, out = Path(folder) / "spec.yaml", Path(folder) / name, Path(folder) / "out"
        spec.write_bytes(SPEC)
        write_dwells(table, data)
        line = [sys.executable, "-m", "planner", "diagnose", str(data), "--spec", str(spec), "-o", str(out)]
        environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parents[1])}
        with subprocess.Popen(line, env=environment, stdout=subprocess.DEVNULL) as process:
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0
        found = json.loads((out / "diagnosis.json").read_text())
    assert found["verdict"] == ("explained" if hides else "clean"), found["verdict"]
    effects = [(e["effect"], e["channels"]) for e in found["effects"]]
    assert effects == ([("temperature_rate", ["gyro_z"])] if hides else []), effects
    for effect in found["effects"]:
        (term,) = effect["terms"]
        assert term["ci95"][0] < 0.004 < term["ci95"][1], term
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


if __name__ == "__main__":
    main()
