"""`planner diagnose` on tables that lack something or cannot be: refused with its line, or judged."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.dwells.dwell_files import read_dwells, write_dwells
from planner.nouns.dwell_table import DwellTable
from tests.calibrate.world import Hidden, Layout, campaign
from tests.diagnose.worlds import RATE_TABLES, SPEC, whole
from tests.outcome import Run

SMALL = Layout(
    temperatures=(-20.0, 20.0, 60.0),
    later=(30.0,),
    rate_repeats=2,
    rate_temperatures=(-20.0, 60.0),
    centrifuge=False,
)
Rows = list[dict[str, str]]


@pytest.fixture(scope="module")
def table() -> DwellTable:
    return campaign(5, [Hidden("warm_up", "gyro_x", 0.02, tau_s=500.0)], SMALL)


@pytest.fixture
def spoilt(table: DwellTable, tmp_path: Path) -> Callable[[Callable[[Rows], Rows]], Path]:
    """Writes the table as CSV with its rows changed, beside the spec."""
    (tmp_path / "spec.yaml").write_bytes(SPEC)

    def write(change: Callable[[Rows], Rows]) -> Path:
        path = tmp_path / "data.csv"
        write_dwells(table, path)
        with path.open(newline="", encoding="utf-8") as file:
            rows = change(list(csv.DictReader(file)))
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)
        return path

    return write


# ---------------------------------------------------------------- refused


def cell(name: str, value: str) -> Callable[[Rows], Rows]:
    return lambda rows: [{**row, name: value} if i == 10 else row for i, row in enumerate(rows)]


def scaled(sensor: str, factor: float) -> Callable[[Rows], Rows]:
    def change(rows: Rows) -> Rows:
        return [
            {k: repr(float(v) * factor) if k.startswith(sensor) else v for k, v in row.items()}
            for row in rows
        ]

    return change


def without(*names: str) -> Callable[[Rows], Rows]:
    return lambda rows: [{k: v for k, v in row.items() if not k.startswith(names)} for row in rows]


def copied(rows: Rows) -> Rows:
    """Every power-on once more under a number of its own."""
    last = max(int(row["run"]) for row in rows)
    return rows + [{**row, "run": str(int(row["run"]) + last)} for row in rows]


REFUSED = {
    "not a number": (cell("gyro_x_dps", "nan"), "data.csv:12:1  gyro_x_dps: empty or not a number"),
    "infinite": (cell("acc_y_g", "inf"), "data.csv:12:1  acc_y_g: infinite"),
    "empty cell": (cell("temp_degc", ""), "data.csv:12:1  temp_degc: empty"),
    "words": (cell("day", "Monday"), "data.csv:12:1  day: 'Monday' is not a number"),
    "every row twice": (lambda rows: [row for row in rows for _ in (0, 1)], "the row is the same as line"),
    "power-ons copied": (copied, "repeats run 1 in every reading"),
    "rad/s": (scaled("gyro", np.pi / 180), "look like rad/s"),
    "m/s²": (scaled("acc", 9.80665), "look like m/s²"),
    "not connected": (scaled("gyro", 0.0), "was the sensor connected"),
    "an axis less": (without("acc_y"), "missing beside its other axes"),
    "seven rows": (lambda rows: rows[:7], "too few"),
    "turns without rates": (without("ref_rate"), "no ref_rate_{x,y,z}_dps, so every row is taken as a rest"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_what_cannot_be_is_refused_with_its_place(fault: str, spoilt, run: Run, tmp_path: Path) -> None:
    change, said = REFUSED[fault]
    outcome = run("diagnose", spoilt(change), "--spec", "spec.yaml", "-o", "out")
    assert outcome.code == 2
    assert said in outcome.err
    assert "Traceback" not in outcome.err
    assert not (tmp_path / "out").exists()


# ---------------------------------------------------------------- judged, and said what is lost

DRIFT_TABLES = ("drift_curve", "drift_curve_temperature", "drift_curve_over_temperature")
LOST = {
    "time_on_s": {"warm_up", "drift", "thermal_lag", "settling", RATE_TABLES[1], *DRIFT_TABLES},
    "day": {"ageing", "bias_step"},
    "temp_rate_degc_min": {"temperature_rate", "thermal_lag", "hysteresis", *RATE_TABLES},
    # the others of temperature are declared
    "temp_degc": {
        "misalignment_temperature",
        "g_sensitivity_temperature",
        "drift_curve_temperature",
        "drift_curve_over_temperature",
        "thermal_lag",
        "hysteresis",
        *RATE_TABLES,
    },
}


@pytest.mark.parametrize("column", LOST)
def test_a_missing_column_names_the_effects_that_cannot_be_tested(column: str, spoilt) -> None:
    table = read_dwells(spoilt(without(column)))
    assert any(note.startswith(f"the file has no {column}: ") for note in table.notes)
    found = whole(replace(table, acc=None))
    assert {u.effect for u in found.untestable if column in u.why and u.sensor == "gyro"} == LOST[column]


def test_without_run_numbers_a_power_on_ends_where_its_time_falls(spoilt, run: Run, tmp_path: Path) -> None:
    outcome = run("diagnose", spoilt(without("run", "acc", "ref_acc")), "--spec", "spec.yaml", "-o", "out")
    assert outcome.code == 0, outcome.err
    assert "no run: a power-on ends where time_on_s falls" in outcome.err
    document = json.loads((tmp_path / "out/diagnosis.json").read_text(encoding="utf-8"))
    assert [(e["effect"], e["channels"]) for e in document["effects"]] == [("warm_up", ["gyro_x"])]


def test_a_dead_channel_is_called_dead_and_not_swapped(spoilt, run: Run) -> None:
    def dead(rows: Rows) -> Rows:
        return [{**row, "gyro_y_dps": "0.01"} for row in without("acc", "ref_acc")(rows)]

    outcome = run("diagnose", spoilt(dead), "--spec", "spec.yaml", "-o", "out")
    assert outcome.code == 0, outcome.err
    assert "gyro_y reads the same in every row while the others move: it looks dead" in outcome.err
    assert "saturated" not in outcome.err


def test_a_modulus_that_never_changes_is_no_effect_of_its_own(table: DwellTable) -> None:
    """|f| = 1 g in every row: |f| ω is the declared scale factor, f_x² + f_y² + f_z² the declared bias."""
    found = whole(replace(table, acc=None))
    why = {u.effect: u.why for u in found.untestable if u.sensor == "gyro"}
    assert "takes it up whole" in why["scale_factor_acceleration"]
    assert all(np.isfinite(n.upper_limit) for n in found.not_found)


def test_one_sensor_with_coarse_numbers_keeps_its_effect(table: DwellTable) -> None:
    """Steps of 0.005 deg/s, five times the noise of a record."""
    assert table.gyro is not None
    step = np.radians(0.005)
    found = whole(replace(table, gyro=np.round(table.gyro / step) * step, acc=None))
    assert {(e.effect, e.channels) for e in found.effects} == {("warm_up", ("gyro_x",))}
