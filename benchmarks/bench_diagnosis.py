"""Seconds of a diagnosis at 500, 4 000 and 30 000 dwells, of a whole report at 4 000; verdicts come first.

Run: OMP_NUM_THREADS=1 python benchmarks/bench_diagnosis.py
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from planner.diagnose.hypotheses.prepared import prepared
from planner.diagnose.hypotheses.sensor import SensorFound, diagnose_sensor
from planner.dwells.dwell_files import write_dwells
from planner.dwells.table_rows import rows_of
from planner.nouns.dwell_table import DwellTable
from tests.calibrate.world import Hidden, Layout, campaign
from tests.diagnose.hypotheses.worlds import DECLARED, SPEC, named


def table_of(rows: int) -> DwellTable:
    """A campaign of about that many rows in which gyro z feels the temperature's rate."""
    repeats = max(1, round(rows / 250))
    layout = Layout(static_repeats=repeats, rate_repeats=repeats, later=(30.0, 60.0))
    table = campaign(3, [Hidden("temperature_rate", "gyro_z", 0.004)], layout)
    keep = np.isin(table.run, np.unique(table.run)[:: max(1, len(table) // rows)])
    return table if rows > 600 else rows_of(table, keep)


def searched(table: DwellTable) -> tuple[float, SensorFound]:
    """Seconds, and what was found on the gyros."""
    start = time.perf_counter()
    found = diagnose_sensor(prepared(replace(table, acc=None)), "gyro", DECLARED, 1)
    return time.perf_counter() - start, found


def main() -> None:
    before: tuple[int, float] | None = None
    for rows in (500, 4_000, 30_000):
        table = table_of(rows)
        seconds, found = searched(table)
        assert named(found.found) == {("temperature_rate", "z")}, named(found.found)
        growth = ""
        if before is not None:
            power = np.log(seconds / before[1]) / np.log(len(table) / before[0])
            growth = f", grows as n^{power:.2f}"
        print(f"{len(table):6d} dwells: {seconds / 3:6.2f} s a channel{growth}")
        before = len(table), seconds
    print(f"whole report of {len(table_of(4_000))} dwells on six channels: {whole_report():.1f} s")


def whole_report() -> float:
    """`planner diagnose` in this process: search, before and after, navigation, report."""
    from planner.pipelines.diagnosing import diagnose
    from planner.report.page import html
    from planner.report.subjects.diagnosis import diagnosis_report
    from planner.spec.load import load_spec

    with tempfile.TemporaryDirectory() as folder:
        spec, data = Path(folder) / "spec.yaml", Path(folder) / "data.csv"
        spec.write_bytes(SPEC)
        write_dwells(table_of(4_000), data)
        start = time.perf_counter()
        (found,) = diagnose(data, load_spec(spec), 1, lambda _: None)
        html(diagnosis_report(found.diagnosis, found.table))
        seconds = time.perf_counter() - start
    assert [e.effect for e in found.diagnosis.found.effects] == ["temperature_rate"]
    return seconds


if __name__ == "__main__":
    main()
