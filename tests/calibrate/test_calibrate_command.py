"""The command on good and broken tables: files, notes, refusals; never a traceback."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.dwells.dwell_files import write_dwells
from planner.dwells.table_rows import rows_of
from planner.nouns.dwell_table import DwellTable
from tests.calibrate import world
from tests.calibrate.truths import LAYOUT
from tests.outcome import Run
from tests.specs import SHIPPED

SPEC = str(SHIPPED / "small_uav.yaml")
Spoil = Callable[[DwellTable], DwellTable]


@pytest.fixture
def calibrate(run: Run) -> Run:
    """`planner calibrate` on a table, into the folder `out` beside it."""
    return lambda data, *more: run("calibrate", data, "--spec", SPEC, "-o", data.parent / "out", *more)


def written(folder: Path, spoil: Spoil = lambda t: t) -> Path:
    path = folder / "data.csv"
    write_dwells(spoil(world.campaign(3, layout=LAYOUT)), path)
    return path


def test_every_number_says_how_well_it_is_known(calibrate: Run, tmp_path: Path) -> None:
    done = calibrate(written(tmp_path), "--json")
    assert done.code == 0
    document = done.json
    for sensor in document["sensors"].values():
        for c in sensor["coefficients"]:
            assert c["ci95"][0] < c["value"] < c["ci95"][1]
            assert c["degrees_of_freedom"] > 1
        assert set(sensor["condition"]) == {"x", "y", "z"}
        for r in sensor["residual"].values():
            assert r["held_out"]
            assert r["after"] < r["before"] / 3.0
    again = (tmp_path / "out/calibration.json").read_bytes()
    figure = (tmp_path / "out/before_after.svg").read_bytes()
    calibrate(tmp_path / "data.csv")
    assert (tmp_path / "out/calibration.json").read_bytes() == again
    assert (tmp_path / "out/before_after.svg").read_bytes() == figure
    assert figure.startswith(b"<svg")
    kinds = {r["kind"] for r in json.loads((tmp_path / "out/random.json").read_text())["random"]["gyro"]}
    assert {"white", "white_density", "run_to_run"} <= kinds


def test_several_units_have_a_folder_each(calibrate: Run, tmp_path: Path) -> None:
    a = world.campaign(3, layout=LAYOUT)
    both = {
        name: np.concatenate([value, value if name != "unit" else np.full(len(a), "u/2")])
        for name, value in vars(a).items()
        if isinstance(value, np.ndarray)
    }
    path = tmp_path / "data.csv"
    write_dwells(replace(a, **both), path)
    assert calibrate(path).code == 0
    assert (tmp_path / "out/u1/calibration.json").exists()
    assert (tmp_path / "out/u_2/calibration.h").exists()


def at_rest(t: DwellTable) -> DwellTable:
    return rows_of(t, np.linalg.norm(t.ref_rate, axis=1) < 0.01)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda t: rows_of(t, t.run == t.run[0]), "too few power-ons"),  # one repeat, one temperature
        (at_rest, "tell less than the spec"),  # no turn but the Earth's: gyro scale factors
        (lambda t: replace(t, ref_rate=None), "no ref_rate"),
    ],
    ids=["one power-on", "no turns", "no reference rate"],
)
def test_what_the_data_cannot_tell_is_said(calibrate: Run, tmp_path: Path, spoil: Spoil, says: str) -> None:
    done = calibrate(written(tmp_path, spoil), "--json")
    assert done.code == 0, done.err
    document = done.json
    notes = [*document["notes"], *(n for s in document["sensors"].values() for n in s["notes"])]
    assert any(says in note for note in notes), notes
    for sensor in document["sensors"].values():
        for c in sensor["coefficients"]:
            if c["status"] == "undetermined":
                assert c["value"] is c["ci95"] is c["standard_error"] is None


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda t: replace(t, gyro=t.gyro * np.pi / 180.0), "rad/s"),
        (lambda t: replace(t, acc=t.acc * world.G), "m/s²"),
        (lambda t: replace(t, temperature_degc=t.temperature_degc + 273.15), "kelvin"),
        (lambda t: replace(t, acc=t.acc[:, [1, 0, 2]]), "swapped"),
        (lambda t: replace(t, acc=t.acc * [1.0, -1.0, 1.0]), "sign"),
        (lambda t: replace(t, time_on=t.time_on[::-1].copy()), "time runs back"),
        (lambda t: rows_of(t, np.append(np.arange(len(t)), len(t) - 1)), "same as line|runs back"),
        (lambda t: rows_of(t, np.arange(1)), "1 rows cannot give"),
        (lambda t: replace(t, acc=np.full_like(t.acc, 0.3)), "dead|ref_acc"),
    ],
    ids=["rad/s", "m/s2", "kelvin", "swapped", "sign", "time", "doubled", "one row", "stuck"],
)  # fmt: skip
def test_bad_tables_are_refused_in_words(calibrate: Run, tmp_path: Path, spoil: Spoil, says: str) -> None:
    import re

    done = calibrate(written(tmp_path, spoil))
    assert done.code == 2
    assert re.search(says, done.err), done.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda text: "", "empty"),
        (lambda text: text.splitlines()[0] + "\n", "no rows"),
        (lambda text: text.replace("60", "nan", 1), "not a number|column"),
        (lambda text: text.replace("gyro_x_dps", "gyro_x_dp", 1), "did you mean gyro_x_dps"),
        (lambda text: "\x00" * 4000, "."),
    ],
    ids=["empty", "header", "nan", "column", "zeros"],
)  # fmt: skip
def test_bad_files_are_refused_in_words(
    calibrate: Run, tmp_path: Path, spoil: Callable[[str], str], says: str
) -> None:
    import re

    path = written(tmp_path)
    path.write_text(spoil(path.read_text()))
    done = calibrate(path)
    assert done.code == 2
    assert re.search(says, done.err), done.err


@pytest.mark.parametrize("cut", [2, 40, 120])
def test_a_torn_last_line_is_refused_or_left_out_and_said(calibrate: Run, tmp_path: Path, cut: int) -> None:
    path = written(tmp_path)
    path.write_text(path.read_text()[:-cut])
    done = calibrate(path)
    left_out = done.code == 0 and "left out" in done.err
    assert left_out or (done.code == 2 and "cells where the table has" in done.err), done.err


def test_bad_options_are_refused(calibrate: Run, tmp_path: Path) -> None:
    path = written(tmp_path)
    assert calibrate(path, "--method", "cub").code == 2
    assert calibrate(path, "--robust", "very").code == 2
    assert calibrate(path, "--prior", str(tmp_path / "none")).code == 2
    (tmp_path / "calibration.json").write_text('{"sensors": {"gyro": {"tables": {}}}}')
    done = calibrate(path, "--prior", str(tmp_path))
    assert done.code == 2
    assert "no calibration.json" in done.err
