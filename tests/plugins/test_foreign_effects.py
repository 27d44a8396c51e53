"""Effects, a trajectory and an export format of another package go the whole way, as ours do."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from planner import __version__, catalog
from planner.calibrate.apply_calibration import correct_recording
from planner.dwells.dwell_files import read_dwells, write_dwells
from planner.errors import InputError
from planner.export.calibration import calibration_text, read_tables
from planner.export.firmware import left_out_notes
from planner.export.json import document_text, plan_document
from planner.nouns.calibration import Calibration, ExtraTerm, SensorCalibration, Tables
from planner.nouns.plan_file import plan_schema, typed_plan
from planner.protocols import RawBlock, Sensor
from planner.readers.text import TextReader
from planner.simulate.hidden import hidden_effect
from tests.outcome import Run
from tests.plugins.installing import Installed
from tests.recordings.recordings import Array, G, save
from tests.shipped_plans import shipped_document
from tests.specs import SHIPPED, planned, small

DPS = np.radians(1.0)
THREE = ("self_heating", "cold_knee", "ripple")
BUDGETS = {
    "self_heating": {"systematic": "0.002 deg/s", "run_to_run": "0.0003 deg/s"},
    "cold_knee": {"systematic": "0.00005 deg/s/K", "run_to_run": "0.000005 deg/s/K"},
    "ripple": {"systematic": "0.002 deg/s", "run_to_run": "0.0003 deg/s"},
}


def flown() -> dict:
    """Small, with the three effects budgeted and calibrated, on a flight of the package's family."""
    spec = small(trajectory={"name": "glide", "duration": "60 s"}, sensitivities="simulated")
    spec["requirement"][0]["limit"] = "600 m"
    spec["unit"]["gyro"] |= BUDGETS
    spec["effects"] += THREE
    spec["benches"]["rate_table"]["axes"] = 2
    for test in spec["tests"].values():
        test["motions"] = 6
        if "gyro.bias" in test["calibrates"]:
            test["calibrates"] += [f"gyro.{name}" for name in THREE]
    return spec


# ---------------------------------------------------------------- planned, exported


def test_planned_with_them_the_plan_names_their_package(installed_example: Installed) -> None:
    made = planned(flown()).plan
    document = plan_document(made)
    assert document["plugins"] == [
        {"kind": kind, "name": name, "distribution": "imu-example", "version": "1.2.0"}
        for kind, name in (*(("effects", n) for n in sorted(THREE)), ("trajectories", "glide"))
    ]
    assert {f"gyro.{name}" for name in THREE} <= set(document["allowances"])
    assert all(r["met"] for r in document["requirements"])
    assert [p.name for p in typed_plan(document).plugins] == [*sorted(THREE), "glide"]
    assert "plugins" in plan_schema()["properties"]


def test_a_plan_of_ours_alone_has_no_such_key(installed_example: Installed) -> None:
    assert "plugins" not in plan_document(planned(small()).plan)


def test_the_program_finds_them_in_a_process_of_its_own(installed_example: Installed, tmp_path: Path) -> None:
    def program(*arguments: object) -> str:
        command = [sys.executable, "-m", "planner", *map(str, arguments)]
        done = subprocess.run(
            command, env=installed_example.environment, cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    spec = SHIPPED / "close_the_loop.yaml"
    hidden = "gyro.cold_knee=0.001 deg/s/K,knee_degc=-30 degC"
    program("simulate", spec, "--hidden", hidden, "-o", "data.csv")
    truth = [t for t in json.loads((tmp_path / "truth.json").read_text())["terms"] if t["hidden"]]
    assert {t["error"] for t in truth} == {"gyro.cold_knee"}
    assert all(t["nonlinear_si"] == {"knee_degc": -30.0} for t in truth)
    (tmp_path / "plan.json").write_text(document_text(shipped_document("close_the_loop")))
    program("export", "plan.json", "--format", "checklist", "-o", "list.txt")
    assert (tmp_path / "list.txt").read_text().startswith("[ ] rate_table/")


# ---------------------------------------------------------------- simulated


@pytest.mark.parametrize(
    ("text", "parameters"),
    [
        ("gyro.cold_knee=0.001 deg/s/K,knee_degc=-30 degC", {"knee_degc": -30.0}),
        ("gyro.cold_knee=0.001 deg/s/K,knee_degc=243.15 K", {"knee_degc": -30.0}),
        ("gyro.cold_knee=0.001 deg/s/K", {}),
        ("gyro.ripple=0.01 deg/s,phase=-20 degC,period=50 K", {"phase": -20.0, "period": 50.0}),
        ("gyro.ripple=0.01 deg/s,phase=0 degC", {"phase": 0.0}),
        ("gyro.self_heating=0.01 deg/s,time_constant=20 min", {"time_constant": 1200.0}),
        ("gyro.heat_flow=0.01 deg/s,ramp=3 K/min", {"ramp": 0.05}),
    ],
)
def test_hidden_parameters_are_of_any_number_unit_and_sign(
    installed_example: Installed, text: str, parameters: dict[str, float]
) -> None:
    found = hidden_effect(text)
    assert found.sensors == ("gyro",)
    assert dict(found.nonlinear) == pytest.approx(parameters)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("knee_degc=-80 degC", "must lie in -60 degC … 40 degC"),
        ("knee_degc=40.1 degC", "must lie in -60 degC … 40 degC"),
        ("knee_degc=-30", "no unit"),
        ("knee_degc=-30 s", "is no temperature's"),
        ("knee=-30 degC", "no parameter 'knee'; it has knee_degc"),
    ],
)
def test_a_parameter_out_of_its_range_is_refused(installed_example: Installed, text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        hidden_effect(f"gyro.cold_knee=0.001 deg/s/K,{text}")


def test_what_is_simulated_is_the_equation(installed_example: Installed, run: Run, tmp_path: Path) -> None:
    """Two campaigns of one seed differ by k sin(2π (T − φ)/P) at the unit's own temperature alone."""
    spec = SHIPPED / "close_the_loop.yaml"
    settings = ["--set", "temperature_jitter=0 K", "--seed", 4]
    run("simulate", spec, "-o", "plain.csv", *settings)
    hidden = "gyro.ripple.y=0.01 deg/s,period=50 K,phase=-20 degC"
    done = run("simulate", spec, "-o", "hidden.csv", "--hidden", hidden, *settings)
    assert done.code == 0, done.err
    plain, other = (read_dwells(tmp_path / f"{name}.csv") for name in ("plain", "hidden"))
    wave = 0.01 * DPS * np.sin(2.0 * np.pi * (plain.temperature_degc + 20.0) / 50.0)
    added = other.gyro - plain.gyro
    # the table is written with nine digits
    np.testing.assert_allclose(added[:, 1], wave, atol=1e-6 * DPS)
    np.testing.assert_allclose(added[:, [0, 2]], 0.0, atol=1e-9)
    np.testing.assert_array_equal(other.acc, plain.acc)


# ---------------------------------------------------------------- calibration: written, read, applied


def calibrated(extra: tuple[ExtraTerm, ...], degc: tuple[float, ...] = (20.0,)) -> dict[Sensor, Tables]:
    """A gyro that has nothing but these terms."""
    nodes = np.array(degc)
    nothing = np.zeros((3, len(nodes)))
    return {"gyro": Tables(nodes, nothing, nothing, np.zeros(3), np.eye(3), extra)}


def written(found: dict[Sensor, Tables]) -> Calibration:
    sensors = tuple(SensorCalibration(s, "declared_effects", (), {}, {}, t, (), ()) for s, t in found.items())
    return Calibration("u1", __version__, "data.csv", "spec", "", sensors)


EXTRA = (
    ExtraTerm("ripple", "x", 0.02 * DPS, {"period": 45.0, "phase": -12.5}),
    ExtraTerm("cold_knee", "y", -0.001 * DPS, {"knee_degc": -30.0}),
    ExtraTerm("self_heating", "z", 0.03 * DPS, {"time_constant": 1500.0}),
)


def added(time_on: Array, degc: Array) -> Array:
    """What EXTRA adds, deg/s, by its equations written out."""
    ripple = 0.02 * np.sin(2 * np.pi * (degc + 12.5) / 45.0)
    knee = -0.001 * np.maximum(-30.0 - degc, 0.0)
    return np.column_stack([ripple, knee, 0.03 * (1.0 - np.exp(-time_on / 1500.0))])


def test_a_calibration_with_them_reads_back(installed_example: Installed, tmp_path: Path) -> None:
    file = tmp_path / "calibration.json"
    file.write_text(calibration_text(written(calibrated(EXTRA))))
    assert read_tables(file)["gyro"].extra == EXTRA
    assert [p["name"] for p in json.loads(file.read_text())["plugins"]] == sorted(THREE)


def test_without_the_package_the_calibration_names_it(
    installed_example: Installed, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "calibration.json"
    file.write_text(calibration_text(written(calibrated(EXTRA))))
    with monkeypatch.context() as without:
        without.setattr(sys, "path", [p for p in sys.path if p != str(installed_example.folder)])
        catalog.forget()
        with pytest.raises(InputError, match=r"needs the effect 'ripple'.*install imu-example 1\.2\.0"):
            read_tables(file)


@pytest.mark.parametrize(
    ("term", "says"),
    [
        (ExtraTerm("ripple", "w", 1.0, {}), "no term 'w'"),
        (ExtraTerm("ripple", "x", 1.0, {"tau": 1.0}), "no parameter 'tau'"),
    ],
)
def test_a_calibration_of_terms_that_do_not_exist_is_refused(
    installed_example: Installed, tmp_path: Path, term: ExtraTerm, says: str
) -> None:
    file = tmp_path / "calibration.json"
    file.write_text(calibration_text(written(calibrated((term,)))))
    with pytest.raises(InputError, match=says):
        read_tables(file)


def test_firmware_says_what_it_lacks_and_how_large_it_is(installed_example: Installed) -> None:
    (note,) = left_out_notes(written(calibrated(EXTRA, (-60.0, 70.0))))
    # the sizes by the equations: amplitude; 0.001 · 30 K; 0.03 · (1 − exp(−7200/1500)) = 0.0298
    for said in ("ripple, up to 0.02 deg/s", "cold_knee, up to 0.03 deg/s", "self_heating, up to 0.03 deg/s"):
        assert said in note
    assert left_out_notes(written(calibrated(()))) == []


def test_apply_corrects_a_recording(installed_example: Installed, tmp_path: Path) -> None:
    n = 3000
    rng = np.random.default_rng(1)
    time, rate = np.arange(n) / 50.0, 50.0 * rng.normal(size=(n, 3))
    degc = np.linspace(-60.0, 60.0, n)
    values = np.column_stack([time, rate + added(time, degc), np.zeros((n, 3)) + 0.5, degc])
    save(tmp_path / "a.csv", values, fmt="%.17g")
    _, notes = correct_recording(tmp_path / "a.csv", tmp_path / "out.csv", calibrated(EXTRA), None)
    back = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(back[:, 2:5], rate, atol=1e-11)
    (said,) = [note for note in notes if "time_on" in note]
    assert "self_heating is corrected" in said
    assert not any("day" in note for note in notes)


def test_apply_corrects_a_dwell_table_and_says_what_it_lacks(
    installed_example: Installed, run: Run, tmp_path: Path
) -> None:
    run("simulate", SHIPPED / "close_the_loop.yaml", "-o", "plain.csv")
    table = read_dwells(tmp_path / "plain.csv")
    moved = table.gyro + DPS * added(table.time_on, table.temperature_degc)
    write_dwells(type(table)(**{**vars(table), "gyro": moved}), tmp_path / "moved.csv")
    (tmp_path / "calibration.json").write_text(calibration_text(written(calibrated(EXTRA))))
    done = run("apply", "calibration.json", "moved.csv", "-o", "back.csv")
    assert done.code == 0, done.err
    np.testing.assert_allclose(read_dwells(tmp_path / "back.csv").gyro, table.gyro, atol=1e-8)
    lines = (tmp_path / "moved.csv").read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("unit,"))
    drop = lines[at].split(",").index("time_on_s")
    cut = [",".join(c for i, c in enumerate(line.split(",")) if i != drop) for line in lines[at:]]
    (tmp_path / "cut.csv").write_text("\n".join(cut) + "\n")
    done = run("apply", "calibration.json", "cut.csv", "-o", "back.csv")
    assert "no column time_on_s: self_heating is corrected as at power-on" in done.err


# ---------------------------------------------------------------- the rate of temperature, from the recording


HEAT = (ExtraTerm("heat_flow", "x", 0.05 * DPS, {"ramp": 3.0 / 60.0}),)


def warming(path: Path, degc: Array, heat: Array, rate: float = 100.0) -> Array:
    """Save a recording at rest whose gyro x has 0.05 tanh(Ṫ/r) on it; what apply makes of it, deg/s."""
    n = len(degc)
    gyro = np.column_stack([0.05 * np.tanh(heat / 0.05), np.zeros((n, 2))])
    force = np.tile([0.0, 0.0, 1.0], (n, 1))
    save(path / "a.csv", np.column_stack([np.arange(n) / rate, 0.01 + gyro, force, degc]), fmt="%.17g")
    _, notes = correct_recording(path / "a.csv", path / "out.csv", calibrated(HEAT), None)
    assert not any("not corrected" in note for note in notes)
    return np.loadtxt(path / "out.csv", delimiter=",", skiprows=1)[:, 2]


def test_on_a_steady_ramp_the_rate_of_temperature_is_exact(
    installed_example: Installed, tmp_path: Path
) -> None:
    time = np.arange(6000) / 100.0
    for kelvin_per_s in (0.05, -0.02):
        left = warming(tmp_path, 20.0 + kelvin_per_s * time, np.full(6000, kelvin_per_s))
        np.testing.assert_allclose(left, 0.01, atol=1e-9)


def test_a_changing_rate_is_followed_to_the_curvature_of_ten_seconds(
    installed_example: Installed, tmp_path: Path
) -> None:
    """T = 20 + A sin ωt: a line over 10 s gives Ṫ (1 − (5ω)²/10), and 5 s beyond the middle at the ends."""
    omega, size = 2 * np.pi / 120.0, 1.0
    time = np.arange(24_000) / 100.0
    left = warming(tmp_path, 20.0 + size * np.sin(omega * time), size * omega * np.cos(omega * time))
    inside = (time > 6.0) & (time < 234.0)
    slack = 0.05 / 0.05 * size * omega * (5 * omega) ** 2 / 10  # slope of the tanh times the error of Ṫ
    assert np.abs(left[inside] - 0.01).max() <= 1.5 * slack
    assert np.abs(left - 0.01).max() <= 0.05 / 0.05 * size * omega**2 * 5.0


def test_the_correction_does_not_know_where_a_block_ends(
    installed_example: Installed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(2)
    time = np.arange(12_000) / 100.0
    degc = 20.0 + 3.0 * np.sin(time / 20.0) + 0.02 * rng.normal(size=len(time))
    found = [warming(tmp_path, degc, np.cos(time / 20.0) * 0.15)]
    whole = TextReader.blocks

    def cut(self: TextReader, *arguments: object) -> Iterator[RawBlock]:
        for block in whole(self, *arguments):
            for first in range(0, len(block.sample), 137):
                rows = slice(first, first + 137)
                columns = {name: values[rows] for name, values in block.columns.items()}
                yield RawBlock(columns, block.sample[rows], {} if first else block.losses)

    monkeypatch.setattr(TextReader, "blocks", cut)
    found.append(warming(tmp_path, degc, np.cos(time / 20.0) * 0.15))
    np.testing.assert_array_equal(*found)


def test_without_a_temperature_that_is_said(installed_example: Installed, tmp_path: Path) -> None:
    values = np.column_stack([np.arange(2000) / 100.0, np.ones((2000, 6)), np.full(2000, np.nan)])
    save(tmp_path / "a.csv", values)
    _, notes = correct_recording(tmp_path / "a.csv", tmp_path / "out.csv", calibrated(HEAT), None)
    assert any("does not tell the rate of temperature: heat_flow is not corrected" in note for note in notes)


def test_what_accelerometers_need_of_the_rate_is_the_corrected_one(tmp_path: Path) -> None:
    """Each sensor has an effect that needs the other: gyros feel the force, accelerometers the rate."""
    n = 500
    rng = np.random.default_rng(3)
    rate, force = 100.0 * rng.normal(size=(n, 3)), 2.0 * rng.normal(size=(n, 3))
    w, f, arm = np.radians(rate), G * force, np.array([0.05, -0.02, 0.03])
    sizes = np.radians(0.01) / G * np.arange(1, 10).reshape(3, 3)
    y = w + np.radians(0.5) + f @ sizes.T
    a = f + np.cross(w, np.cross(w, arm))
    bias = np.full((3, 1), np.radians(0.5))
    flat, zero, one = np.array([20.0]), np.zeros((3, 1)), np.eye(3)
    felt = tuple(
        ExtraTerm("g_sensitivity", "xyz"[i] + "xyz"[j], float(sizes[i, j]))
        for i in range(3)
        for j in range(3)
    )
    lever = tuple(ExtraTerm("lever_arm", axis, float(r)) for axis, r in zip("xyz", arm, strict=True))
    tables: dict[Sensor, Tables] = {
        "gyro": Tables(flat, bias, zero, np.zeros(3), one, felt),
        "accelerometer": Tables(flat, zero, zero, np.zeros(3), one, lever),
    }
    values = np.column_stack([np.arange(n) / 100.0, np.degrees(y), a / G, np.full(n, 20.0)])
    save(tmp_path / "a.csv", values, fmt="%.17g")
    correct_recording(tmp_path / "a.csv", tmp_path / "out.csv", tables, None)
    back = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    # each round wins what the coupling is small by: 2 ω r δω/g and 0.1 deg/s/g, 1e-3 twice of 0.5 deg/s
    np.testing.assert_allclose(back[:, 2:5], rate, atol=1e-5)
    np.testing.assert_allclose(back[:, 5:8], force, atol=1e-5)
