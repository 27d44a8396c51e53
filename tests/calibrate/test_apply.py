"""A calibration applied to recordings and dwell tables: the true input comes back, by closed form."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner import catalog
from planner.calibrate.apply_calibration import COLUMNS, correct_dwells, correct_recording
from planner.dwells.dwell_files import read_dwells
from planner.nouns.calibration import ExtraTerm, Tables
from planner.recordings.column_map import ColumnMap
from tests.outcome import Run
from tests.recordings.recordings import HEADER, Array, G, save

NODES = np.array([-20.0, 20.0, 60.0])


def tables(seed: int, unit: float, extra: tuple[ExtraTerm, ...] = ()) -> Tables:
    """Bias of 0.01 units, scale factor 1 %, misalignment 5 mrad."""
    rng = np.random.default_rng(seed)
    skew = 0.005 * rng.normal(size=(3, 3))
    np.fill_diagonal(skew, 0.0)
    return Tables(
        temperature_degc=NODES,
        bias=0.01 * unit * rng.normal(size=(3, 3)),
        scale=0.01 * rng.normal(size=(3, 3)),
        asymmetry=0.002 * rng.normal(size=3),
        misalignment=np.eye(3) + skew,
        extra=extra,
    )


def measured(true: Array, t: Array, table: Tables) -> Array:
    """The measurement equation written out: y = (1 + κ)(M u) + b."""
    mixed = true @ table.misalignment.T
    y = np.empty_like(true)
    for i in range(3):
        kappa = np.interp(t, NODES, table.scale[i]) + 0.5 * np.sign(mixed[:, i]) * table.asymmetry[i]
        y[:, i] = (1 + kappa) * mixed[:, i] + np.interp(t, NODES, table.bias[i])
    return y


def back(path: Path) -> Array:
    assert path.read_text().partition("\n")[0] == ",".join(COLUMNS)
    return np.loadtxt(path, delimiter=",", skiprows=1)


def world(seed: int, n: int = 500) -> tuple[Array, Array, Array]:
    """Rates in deg/s, forces in g and temperatures."""
    rng = np.random.default_rng(seed)
    return 100 * rng.normal(size=(n, 3)), 2 * rng.normal(size=(n, 3)), rng.uniform(-20, 60, n)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000))
def test_the_true_input_comes_back(tmp_path_factory, seed):
    path = tmp_path_factory.mktemp("a")
    rate, force, t = world(seed)
    found = {"gyro": tables(seed, np.radians(1.0)), "accelerometer": tables(seed + 1, G)}
    y = np.degrees(measured(np.radians(rate), t, found["gyro"]))
    f = measured(force * G, t, found["accelerometer"]) / G
    save(path / "a.csv", np.column_stack([np.arange(500) / 100, y, f, t]), fmt="%.17g")
    rows, _ = correct_recording(path / "a.csv", path / "out.csv", found, None)
    values = back(path / "out.csv")
    assert rows == 500
    # digits of a double, and the sign of a bias-sized input may be taken for the other side of zero
    np.testing.assert_allclose(values[:, 2:5], rate, atol=1e-9)
    np.testing.assert_allclose(values[:, 5:8], force, atol=1e-9)
    np.testing.assert_array_equal(values[:, 1], t)


def test_effects_of_the_specific_force_take_the_corrected_accelerometers(tmp_path):
    rate, force, t = world(3)
    names = ("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz")
    sizes = np.radians(0.01) / G * np.arange(1, 10).reshape(3, 3)
    known = [term.name for term in catalog.effects()["g_sensitivity"].terms("gyro")]
    assert set(known) == set(names)
    extra = tuple(
        ExtraTerm("g_sensitivity", name, float(sizes["xyz".index(name[0]), "xyz".index(name[1])]))
        for name in known
    )
    found = {"gyro": tables(3, np.radians(1.0), extra), "accelerometer": tables(4, G)}
    y = np.degrees(measured(np.radians(rate), t, found["gyro"]) + force * G @ sizes.T)
    f = measured(force * G, t, found["accelerometer"]) / G
    save(tmp_path / "a.csv", np.column_stack([np.arange(500) / 100, y, f, t]), fmt="%.17g")
    correct_recording(tmp_path / "a.csv", tmp_path / "out.csv", found, None)
    np.testing.assert_allclose(back(tmp_path / "out.csv")[:, 2:5], rate, atol=1e-9)


def test_warm_up_counts_from_the_power_on_that_the_map_names(tmp_path):
    n = 400
    time, amplitude, tau = np.arange(n) / 10, np.radians(0.05), 30.0
    term = next(t.name for t in catalog.effects()["warm_up"].terms("gyro") if t.name.startswith("x"))
    extra = (ExtraTerm("warm_up", term, amplitude, {"time_constant": tau}),)
    plain = Tables(np.array([20.0]), np.zeros((3, 1)), np.zeros((3, 1)), np.zeros(3), np.eye(3), extra)
    drift = np.degrees(amplitude) * np.exp(-(time + 15.0) / tau)
    values = np.column_stack([time, drift + 1.0, np.full(n, 2.0), np.full(n, 3.0)])
    save(tmp_path / "a.csv", values, "t,x,y,z", fmt="%.17g")
    columns = {"time": {"column": "t", "unit": "s"}, "gyro": {"x": "x", "y": "y", "z": "z", "unit": "deg/s"}}
    given_map = ColumnMap.model_validate(columns | {"time_on": "15 s"})
    _, notes = correct_recording(tmp_path / "a.csv", tmp_path / "out.csv", {"gyro": plain}, given_map)
    np.testing.assert_allclose(
        back(tmp_path / "out.csv")[:, 2:5], np.tile([1.0, 2.0, 3.0], (n, 1)), atol=1e-12
    )
    assert not any("time_on" in note for note in notes)


def in_blocks(path: Path, rows: int, found, monkeypatch) -> Array:
    """Rates in deg/s of a recording that is read and corrected so many rows at a time."""
    monkeypatch.setattr("planner.readers.parquet.BLOCK_ROWS", rows)
    correct_recording(path, path.with_suffix(".csv"), found, None)
    return back(path.with_suffix(".csv"))[:, 2:5]


def warmed(path: Path, time: Array, t: Array, added: Array) -> None:
    """A recording of 1, 2, 3 deg/s at a temperature, with an error in deg/s added on x."""
    import pyarrow as pa
    from pyarrow import parquet

    rate = np.tile([1.0, 2.0, 3.0], (len(time), 1))
    rate[:, 0] += added
    values = np.column_stack([time, rate, np.zeros((len(time), 2)), np.ones(len(time)), t])
    parquet.write_table(pa.table(dict(zip(HEADER.split(","), values.T, strict=True))), path)


def remembering(effect: str, value: float, nonlinear: dict[str, float]) -> dict[str, Tables]:
    extra = (ExtraTerm(effect, "x", value, nonlinear),)
    nothing = np.zeros((3, 1))
    return {"gyro": Tables(np.array([20.0]), nothing, nothing, np.zeros(3), np.eye(3), extra)}


def test_a_thermal_lag_goes_on_over_the_borders_of_blocks(tmp_path, monkeypatch):
    """T = 20 + 30 (1 − exp(−t / 200)), τ = 300: T − T_b = 90 (exp(−t / 300) − exp(−t / 200)), up to 13 K."""
    time = np.arange(12_000) / 10.0
    t = 20.0 + 30.0 * -np.expm1(-time / 200.0)
    behind = 90.0 * (np.exp(-time / 300.0) - np.exp(-time / 200.0))
    warmed(tmp_path / "a.parquet", time, t, 0.01 * behind)
    found = remembering("thermal_lag", np.radians(0.01), {"time_constant": 300.0})
    one = in_blocks(tmp_path / "a.parquet", 1 << 18, found, monkeypatch)
    many = in_blocks(tmp_path / "a.parquet", 700, found, monkeypatch)
    # of 0.13 deg/s; 1e-3 K: in the first 0.4 s the temperature before a block goes on with the slope of 10 s
    np.testing.assert_allclose(many, one, atol=1.2e-5)
    np.testing.assert_allclose(many, np.tile([1.0, 2.0, 3.0], (len(time), 1)), atol=1.2e-5)


def test_a_hysteresis_goes_on_over_the_borders_of_blocks(tmp_path, monkeypatch):
    time = np.arange(12_000) / 10.0
    t = np.interp(time, [0.0, 300.0, 600.0], [20.0, 60.0, 40.0])  # it fell last, and stands above the room
    falling = time > 300.0
    warmed(tmp_path / "a.parquet", time, t, 0.02 * np.where(falling, -0.5, 0.5))
    found = remembering("hysteresis", np.radians(0.02), {})
    one = in_blocks(tmp_path / "a.parquet", 1 << 18, found, monkeypatch)
    many = in_blocks(tmp_path / "a.parquet", 700, found, monkeypatch)
    np.testing.assert_allclose(many, one, atol=1e-12)
    sure = np.abs(time - 300.0) > 5.0  # the slope is one over 10 s
    np.testing.assert_allclose(many[sure], np.tile([1.0, 2.0, 3.0], (int(sure.sum()), 1)), atol=1e-12)


def test_the_order_of_a_dwell_table_does_not_matter_to_a_thermal_lag(tmp_path):
    """Two power-ons whose records take turns in the file, as two units on one table would be written."""
    head = "run,time_on_s,duration_s,temp_degc,gyro_x_dps,gyro_y_dps,gyro_z_dps\n"
    lines = [f"{run},{60 * k},1,{20 + run * k},1,2,3\n" for k in range(10) for run in (1, 2)]
    found = remembering("thermal_lag", np.radians(0.01), {"time_constant": 300.0})
    rates = []
    for name, rows in (("mixed", lines), ("sorted", sorted(lines, key=lambda line: line[0]))):
        (tmp_path / f"{name}.csv").write_text(head + "".join(rows))
        correct_dwells(tmp_path / f"{name}.csv", tmp_path / f"{name}_out.csv", found)
        table = read_dwells(tmp_path / f"{name}_out.csv")
        rates.append(table.gyro[np.lexsort((table.time_on, table.run))])
        np.testing.assert_array_equal(table.run, [int(row[0]) for row in rows])
    np.testing.assert_allclose(rates[0], rates[1], rtol=1e-12)


def test_what_cannot_be_corrected_is_nan_and_told(tmp_path):
    rate, force, t = world(5)
    values = np.column_stack([np.arange(500) / 100, rate, force, t])
    values[10, 2], values[20:30, 1:7], values[100:120, 7] = np.nan, 0.0, np.nan
    save(tmp_path / "a.csv", values)
    found = {"gyro": tables(5, np.radians(1.0)), "accelerometer": tables(6, G)}
    rows, notes = correct_recording(tmp_path / "a.csv", tmp_path / "out.csv", found, None)
    lost = np.isnan(back(tmp_path / "out.csv")[:, 2:]).any(axis=1)
    assert rows == 500
    assert np.flatnonzero(lost).tolist() == [10, *range(20, 30)]
    assert any("1 not finite, 10 zero padding" in note for note in notes)
    assert any("dead in 20 samples" in note for note in notes)


def test_leaving_the_table_is_told(tmp_path):
    rate, force, t = world(7)
    save(tmp_path / "a.csv", np.column_stack([np.arange(500) / 100, rate, force, t + 20]))
    _, notes = correct_recording(
        tmp_path / "a.csv", tmp_path / "out.csv", {"gyro": tables(7, np.radians(1.0))}, None
    )
    assert any("leave the table" in note for note in notes)
    assert any("no accelerometer" in note for note in notes)


# ---------------------------------------------------------------- command


def document(gyro: Tables) -> dict[str, object]:
    """A calibration.json with the keys that apply reads."""
    return {
        "sensors": {
            "gyro": {
                "tables": {
                    "temperature_degc": gyro.temperature_degc.tolist(),
                    "bias_dps": np.degrees(gyro.bias).tolist(),
                    "scale_factor": gyro.scale.tolist(),
                    "asymmetry": gyro.asymmetry.tolist(),
                    "misalignment": gyro.misalignment.tolist(),
                    "extra": [],
                    "reach_k": gyro.reach,
                }
            }
        }
    }


def test_the_command_corrects_a_recording(tmp_path, run: Run):
    rate, force, t = world(8)
    gyro = tables(8, np.radians(1.0))
    y = np.degrees(measured(np.radians(rate), t, gyro))
    save(tmp_path / "a.csv", np.column_stack([np.arange(500) / 100, y, force, t]), fmt="%.17g")
    (tmp_path / "calibration.json").write_text(json.dumps(document(gyro)))
    outcome = run("apply", "calibration.json", "a.csv", "-o", "out.csv", "--json")
    assert outcome.code == 0, outcome.err
    assert outcome.json["rows"] == 500
    np.testing.assert_allclose(back(tmp_path / "out.csv")[:, 2:5], rate, atol=1e-9)
    np.testing.assert_allclose(back(tmp_path / "out.csv")[:, 5:8], force, atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("calibration.json", "absent.csv", "-o", "out.csv"), "cannot read absent.csv"),
        (("absent.json", "a.csv", "-o", "out.csv"), "cannot read absent.json"),
        (("a.csv", "a.csv", "-o", "out.csv"), "is no calibration.json"),
        (("calibration.json", "a.csv", "-o", "a.csv"), "is the recording itself"),
        (("calibration.json", "a.csv", "-o", "out.parquet"), "name it .csv"),
        (("calibration.json", "b.csv", "-o", "out.csv"), "say with --columns"),
    ],
)
def test_bad_input_is_refused_in_words(tmp_path, run: Run, arguments, said):
    rate, force, t = world(9, 50)
    save(tmp_path / "a.csv", np.column_stack([np.arange(50) / 100, rate, force, t]))
    save(tmp_path / "b.csv", rate, "p,q,r")
    (tmp_path / "calibration.json").write_text(json.dumps(document(tables(9, 0.01))))
    before = (tmp_path / "a.csv").read_bytes()
    outcome = run("apply", *arguments)
    assert outcome.code == 2
    assert said in outcome.err
    assert (tmp_path / "a.csv").read_bytes() == before
    assert not (tmp_path / arguments[-1]).exists() or arguments[-1] == "a.csv"
    assert HEADER in before.decode()
