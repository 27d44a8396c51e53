"""The firmware's files: the C that comes out corrects as Python does; the image holds the same."""

from __future__ import annotations

import math
import shutil
import struct
import subprocess
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner import __version__, catalog
from planner.calibrate.correction import corrected
from planner.export.binary_image import binary_image
from planner.export.c_header import c_header
from planner.export.firmware import firmware_tables, left_out_notes
from planner.nouns.calibration import Calibration, ExtraTerm, SensorCalibration, Tables
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from planner.units import STANDARD_GRAVITY_MPS2 as G

DEG = np.pi / 180.0
CURVES = (
    "load_curve",
    "scale_factor_curve",
    "scale_factor_polynomial",
    "scale_factor_acceleration",
    "scale_factor_acceleration_squared",
    "drift_curve",
    "drift_curve_temperature",
    "drift_curve_over_temperature",
    "settling",
    "temperature_rate_table",
    "temperature_rate_table_over_time",
)
PRODUCTS = {  # the size of a coefficient for each sensor, SI
    "drift": {"gyro": 1e-3 * DEG / 3600.0, "accelerometer": 1e-3 * G / 3600.0},
    "g_squared_sensitivity": {"gyro": 1e-4 * DEG / G**2},
    "g_product_sensitivity": {"gyro": 1e-4 * DEG / G**2},
    "vibration_rectification": {"gyro": 1e-5 * DEG / G**2, "accelerometer": 1e-6 / G},
    "cross_coupling": {"gyro": 1e-6 / DEG, "accelerometer": 1e-6 / G},
    "g_sensitivity_temperature": {"gyro": 1e-5 * DEG / G},
    "misalignment_temperature": {"gyro": 1e-5, "accelerometer": 1e-5},
}
MAIN = """
#include <stdio.h>
#include "calibration.h"
int main(void)
{
    float t, r, on, gyro[3], acc[3], w[3], f[3];
    while (scanf("%f %f %f %f %f %f", &t, &r, &on, gyro, gyro + 1, gyro + 2) == 6
           && scanf("%f %f %f", acc, acc + 1, acc + 2) == 3)
    {
        planner_correct_acc(acc, t, r, on, acc, f);
        planner_correct_gyro(gyro, t, r, on, f, w);
        printf("%.9g %.9g %.9g %.9g %.9g %.9g\\n", w[0], w[1], w[2], f[0], f[1], f[2]);
    }
    return 0;
}
"""


def tables(sensor: Sensor, seed: int, nodes: int, effects: bool = True) -> Tables:
    rng = np.random.default_rng([seed, len(sensor), nodes])
    unit = DEG if sensor == "gyro" else G
    extra = []
    for axis in "xyz" if effects else "":
        extra += [
            ExtraTerm("temperature_rate", axis, float(rng.normal() * 1e-3 * unit * 60.0)),
            ExtraTerm("warm_up", axis, float(rng.normal() * 1e-2 * unit), {"time_constant": 300.0}),
            ExtraTerm("scale_factor_nonlinearity", axis, float(rng.normal() * 1e-3)),
        ]
        if sensor == "gyro":
            extra += [
                ExtraTerm("g_sensitivity", axis + a, float(rng.normal() * 1e-2 * DEG / G)) for a in "xyz"
            ]
    for name in CURVES if effects else ():
        effect = catalog.effects()[name]
        if sensor in effect.sensors:
            size = {"load_curve": 1e-2 * DEG, "scale_factor_acceleration": 1e-5 / G}.get(name, 1e-4)
            size = 1e-3 * unit if name in ("drift_curve", "settling") else size
            size = 1e-5 * unit if name == "drift_curve_temperature" else size
            size = 1e-7 / G**2 if name == "scale_factor_acceleration_squared" else size
            size = 1e-3 * unit if name.startswith("temperature_rate_table") else size
            extra += [ExtraTerm(name, t.name, float(rng.normal() * size)) for t in effect.terms(sensor)]
    for name, sizes in PRODUCTS.items() if effects else ():
        for t in catalog.effects()[name].terms(sensor) if sensor in sizes else ():
            extra.append(ExtraTerm(name, t.name, float(rng.normal() * sizes[sensor])))
    return Tables(
        np.linspace(-60.0, 70.0, nodes) + rng.uniform(-2.0, 2.0, nodes),
        rng.normal(size=(3, nodes)) * 0.03 * unit,
        rng.normal(size=(3, nodes)) * 5e-3,
        rng.normal(size=3) * 2e-3,
        np.eye(3) + rng.normal(size=(3, 3)) * 5e-3 * (1.0 - np.eye(3)),
        tuple(extra),
    )


def calibration(seed: int = 0, nodes: int = 6, effects: bool = True) -> Calibration:
    sensors = tuple(
        SensorCalibration(s, "declared_effects", (), {}, {}, tables(s, seed, nodes, effects), (), ())
        for s in ("gyro", "accelerometer")
    )
    return Calibration("u1", __version__, "data */ int evil; /*", "spec", "", sensors)


def readings(seed: int, n: int = 400) -> DwellTable:
    """Readings far beyond the tables' ends, of either sign, at rest and on the move."""
    rng = np.random.default_rng([seed, 9])
    return DwellTable(
        unit=np.full(n, "u1"),
        run=np.ones(n, dtype=np.int64),
        day=np.zeros(n),
        time_on=rng.uniform(0.0, 2000.0, n),
        duration=np.ones(n),
        temperature_degc=rng.uniform(-90.0, 100.0, n),
        temperature_rate=rng.uniform(-0.05, 0.05, n),
        ref_rate=None,
        ref_acc=None,
        gyro=rng.uniform(-500.0, 500.0, (n, 3)) * DEG * rng.choice([1.0, 1e-3], (n, 1)),
        acc=rng.uniform(-110.0, 110.0, (n, 3)) * G * rng.choice([1.0, 0.2, 0.01], (n, 1)),
    )


def through_c(header: str, table: DwellTable, folder: Path) -> np.ndarray:
    """(n, 6) deg/s and g from the compiled header."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("no C compiler on this system")
    (folder / "calibration.h").write_text(header)
    (folder / "main.c").write_text(MAIN)
    program = folder / "correct"
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    made = subprocess.run(
        [compiler, *strict, "-o", program, folder / "main.c", "-lm"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    columns = np.column_stack(
        [
            table.temperature_degc,
            table.temperature_rate * 60.0,
            table.time_on,
            table.gyro / DEG,
            table.acc / G,
        ]
    )
    lines = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in columns)
    out = subprocess.run([program], input=lines, capture_output=True, text=True, check=True).stdout
    return np.array(out.split(), dtype=float).reshape(len(table), 6)


@pytest.mark.parametrize(
    ("seed", "nodes", "effects"), [(0, 6, True), (1, 1, True), (2, 15, True), (3, 4, False)]
)
def test_compiled_arrays_correct_as_python_does(seed: int, nodes: int, effects: bool, tmp_path: Path) -> None:
    found, table = calibration(seed, nodes, effects), readings(seed)
    here = corrected(table, {s.sensor: s.tables for s in found.sensors})
    there = through_c(c_header(found), table, tmp_path)
    # a float keeps 24 bits of the reading; a few roundings of 500 deg/s and 110 g: 6e-8 times eight
    for ours, theirs, largest in (
        (here.gyro / DEG, there[:, :3], 500.0),
        (here.acc / G, there[:, 3:], 110.0),
    ):
        np.testing.assert_allclose(theirs, ours, rtol=0, atol=8 * 6e-8 * largest)


def test_small_readings_keep_their_digits(tmp_path: Path) -> None:
    """At rest the error of a float is that of the bias, not that of full scale."""
    found, table = calibration(4, 6, effects=False), readings(4)
    rest = table.gyro / 500.0
    table = DwellTable(**{**vars(table), "gyro": rest})
    here = corrected(table, {s.sensor: s.tables for s in found.sensors})
    there = through_c(c_header(found), table, tmp_path)
    np.testing.assert_allclose(there[:, :3], here.gyro / DEG, rtol=0, atol=8 * 6e-8)


def test_a_name_cannot_leave_its_comment() -> None:
    text = c_header(calibration())
    assert text == c_header(calibration())
    for comment in text.split("/*")[1:]:
        assert comment.count("*/") == 1


SHAPES = {  # as the layout says; N nodes
    "temperature": "N",
    "bias": "N3",
    "plus": "N3",
    "minus": "N3",
    "drift": "3",
    "warm_up": "3",
    "time_constant": "3",
    "acceleration": "33",
    "nonlinearity": "3",
    "alignment": "33",
}


def read_image(data: bytes) -> dict[str, dict[str, np.ndarray]]:
    """Sensor -> array name -> values, by the layout and not by planner."""
    magic, version, count = struct.unpack_from("<4sHH", data)
    assert magic == b"IMUC"
    assert version in (1, 2)
    assert struct.unpack("<I", data[-4:])[0] == zlib.crc32(data[:-4])
    found, at = {}, 8
    for _ in range(count):
        kind, nodes, _, _ = struct.unpack_from("<HHff", data, at)
        at += 12
        arrays = found[("gyro", "accelerometer")[kind]] = {}
        for name, letters in SHAPES.items():
            shape = [nodes if letter == "N" else int(letter) for letter in letters]
            arrays[name] = np.frombuffer(data, "<f4", math.prod(shape), at).reshape(shape)
            at += arrays[name].nbytes
        curves, at = struct.unpack_from("<H", data, at)[0] if version == 2 else 0, at + 2 * (version == 2)
        for _ in range(curves):
            number, floats = struct.unpack_from("<HH", data, at)
            arrays[f"curve {number}"] = np.frombuffer(data, "<f4", floats, at + 4)
            at += 4 + 4 * floats
    assert at == len(data) - 4
    return found


@pytest.mark.parametrize("effects", [True, False])
def test_the_image_holds_the_arrays_of_the_header(effects: bool) -> None:
    found = calibration(5, effects=effects)
    back = read_image(binary_image(found))
    assert binary_image(found)[4] == (2 if effects else 1)  # without new tables the old image, byte by byte
    for sensor in firmware_tables(found):
        for name, values in sensor.arrays().items():
            assert back[sensor.sensor][name].tobytes() == values.astype("<f4").tobytes()
        for curve in sensor.curves:
            floats = np.concatenate([values.ravel() for values in curve.arrays.values()])
            assert back[sensor.sensor][f"curve {curve.number}"].tobytes() == floats.astype("<f4").tobytes()


def test_what_the_arrays_cannot_hold_is_said() -> None:
    found = calibration(8, effects=False)
    gyro = found.sensors[0]
    bent = Tables(**{**vars(gyro.tables), "extra": (ExtraTerm("ageing", "x", 1e-9),)})
    odd = SensorCalibration(**{**vars(gyro), "tables": bent})
    found = Calibration(**{**vars(found), "sensors": (odd, found.sensors[1])})
    # 1e-9 rad/s² over a year are 1.807 deg/s
    assert "ageing, up to 1.8 deg/s" in c_header(found)
    (note,) = left_out_notes(found)
    assert "ageing, up to 1.8 deg/s" in note


@pytest.mark.parametrize("dead", [np.nan, -273.0, 1e6])
def test_a_dead_temperature_sensor_is_normal_conditions(dead: float, tmp_path: Path) -> None:
    """K 4.3.2: coefficients that need no temperature; here those of the tables at 20 degC."""
    found, table = calibration(6, effects=False), readings(6, n=20)
    there = through_c(c_header(found), replace(table, temperature_degc=np.full(20, dead)), tmp_path)
    here = corrected(
        replace(table, temperature_degc=np.full(20, 20.0)), {s.sensor: s.tables for s in found.sensors}
    )
    np.testing.assert_allclose(there[:, :3], here.gyro / DEG, rtol=0, atol=8 * 6e-8 * 500.0)
