"""A recording goes in by a map alone, in whatever form a lab wrote it; and the map can be guessed."""

from __future__ import annotations

import json
import re
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from planner.errors import InputError
from planner.recordings.column_map import ColumnMap, map_of, read_map
from planner.recordings.guess_map import guessed_map
from planner.recordings.map_help import map_help_text
from planner.recordings.map_schema import column_map_schema
from planner.recordings.raw_to_dwells import reduce_recordings
from planner.recordings.reduction import Reduction
from planner.spec.yaml12 import read_yaml
from tests.outcome import Run
from tests.recordings.labs import (
    COLUMNS,
    ONE_RUN,
    PLAIN,
    RECORDED,
    RESTS,
    THREE_RUNS,
    Lab,
    readings,
    rows,
    text,
)
from tests.recordings.recordings import ACC_BIAS, GYRO_BIAS, G, tumbled


def reduced(folder: Path, lab: Lab) -> Reduction:
    path, columns = lab(folder)
    map_path = folder.parent / f"{folder.name}.yaml"
    map_path.write_text(columns)
    return reduce_recordings([path], read_map(map_path))


def holds_the_truth(found: Reduction, power_ons: int) -> None:
    """Every rest of every power-on, with the means that were put in; the turns between them are kept."""
    table = found.table
    assert len(found.rows) == RESTS * power_ons
    # of 260 samples: 0.05 deg/s and 2 mg over the root, 5 sigma; the digits of counts add a tenth
    np.testing.assert_allclose(np.degrees(table.gyro), np.tile(GYRO_BIAS, (len(table), 1)), atol=0.02)
    up = np.tile(RECORDED.up, (power_ons, 1)) + ACC_BIAS
    np.testing.assert_allclose(table.acc / G, up, atol=1e-3)
    assert sorted(set(table.run.tolist())) == list(range(1, power_ons + 1))
    assert found.motions is not None
    turned = np.linalg.norm((found.motions.gyro - np.radians(GYRO_BIAS)).T * found.motions.duration, axis=0)
    assert np.degrees(turned.sum()) == pytest.approx(90.0 * (RESTS - 1) * power_ons, rel=0.02)


@pytest.mark.parametrize("lab", ONE_RUN)
def test_a_form_is_read_by_a_map(tmp_path: Path, lab: str) -> None:
    holds_the_truth(reduced(folder_of(tmp_path), ONE_RUN[lab]), 1)


@pytest.mark.parametrize("lab", THREE_RUNS)
def test_power_ons_of_one_file_are_told_apart(tmp_path: Path, lab: str) -> None:
    holds_the_truth(reduced(folder_of(tmp_path), THREE_RUNS[lab]), 3)


def folder_of(tmp_path: Path) -> Path:
    folder = tmp_path / "run"
    folder.mkdir()
    return folder


def test_inertial_units_of_one_file_are_told_apart(tmp_path: Path) -> None:
    pairs = zip(rows(readings(1)), rows(readings(2)), strict=True)
    body = [f"{row},sn{k}" for pair in pairs for k, row in enumerate(pair)]
    path = text(tmp_path / "a.csv", [",".join(COLUMNS) + ",serial", *body])
    found = reduce_recordings([path], map_of((PLAIN + "unit: {column: serial}\n").encode(), path))
    assert sorted(set(found.table.unit.tolist())) == ["sn0", "sn1"]
    assert len(found.rows) == 2 * RESTS


# ---------------------------------------------------------------- clocks


@pytest.mark.parametrize("seed", [1, 2])
def test_a_jittering_clock_is_read_and_told(tmp_path: Path, seed: int) -> None:
    """Steps of 1 to 497 ms: rests stay whole, means true, the jitter is said, a long gap stays one."""
    rng = np.random.default_rng(seed)
    recorded = tumbled(rate=1000.0, rest=6.0, turns=(0, 1, 2))
    values = recorded.readings(0.05, 0.002, seed)[:, :7]
    steps = np.clip(np.round(rng.lognormal(np.log(8.0), 1.0, len(values))), 1, 497).astype(int)
    at = np.cumsum(steps)
    kept = values[at[at < len(values)]]
    kept[kept[:, 0] > 24.0, 0] += 30.0  # a pause in the last rest
    path = text(tmp_path / "a.csv", [",".join(COLUMNS), *rows(kept)])
    found = reduce_recordings([path], map_of(PLAIN.encode(), path))
    assert len(found.rows) == 5  # four rests, the last in two
    up = np.vstack([recorded.up, recorded.up[-1:]])
    np.testing.assert_allclose(found.table.acc / G, up + ACC_BIAS, atol=2e-3)
    (note,) = [note for note in found.table.notes if "jitters" in note]
    assert re.search(r"steps of 1 to 3\d{4} ms, usually [78]", note)
    assert f"{len(kept)} samples" in note
    assert found.clocks[str(path)].jitters


def test_an_even_clock_with_lost_samples_does_not_jitter(tmp_path: Path) -> None:
    values = np.delete(readings(), np.arange(50, 1700, 31), axis=0)
    path = text(tmp_path / "a.csv", [",".join(COLUMNS), *rows(values)])
    found = reduce_recordings([path], map_of(PLAIN.encode(), path))
    assert not found.clocks
    assert len(found.rows) == RESTS


def test_files_without_a_time_in_common_are_refused(tmp_path: Path) -> None:
    values = readings()
    text(tmp_path / "g.csv", ["t,gx,gy,gz", *rows(values[:, :4] + [5000.0, 0, 0, 0])])
    path = text(tmp_path / "a.csv", ["t,ax,ay,az", *rows(values[:, [0, 4, 5, 6]])])
    columns = "time: {column: t, unit: s}\nacc: {x: ax, y: ay, z: az, unit: g}\n"
    columns += "gyro: {file: g.csv, x: gx, y: gy, z: gz, unit: deg/s}\n"
    with pytest.raises(InputError, match="no time in common"):
        reduce_recordings([path], map_of(columns.encode(), path))


# ---------------------------------------------------------------- guessing


OF_ONE_FILE = [name for name in ONE_RUN if name not in ("apart_and_called_mat", "apart_at_other_rates")]


@pytest.mark.parametrize("lab", OF_ONE_FILE)
def test_a_guessed_map_reads_the_file(tmp_path: Path, lab: str) -> None:
    folder = folder_of(tmp_path)
    path, _ = ONE_RUN[lab](folder)
    columns = map_of(guessed_map([path]).encode(), path)
    if lab == "offsets_in_units":  # an axis that points the other way is no guess's to turn: it is found out
        with pytest.raises(InputError, match="axes do not fit"):
            reduce_recordings([path], columns)
        return
    found = reduce_recordings([path], columns)
    assert len(found.rows) == RESTS
    # zeros and scales of counts are not to be found from quarter turns alone
    np.testing.assert_allclose(np.linalg.norm(found.table.acc, axis=1) / G, 1.0, atol=0.06)
    if lab != "counts":
        np.testing.assert_allclose(np.degrees(found.table.gyro), np.tile(GYRO_BIAS, (RESTS, 1)), atol=0.02)


@pytest.mark.parametrize("lab", ["by_a_column", "by_the_clock", "n_3_m", "of_hdf5"])
def test_a_guessed_map_sees_the_power_ons(tmp_path: Path, lab: str) -> None:
    path, _ = THREE_RUNS[lab](folder_of(tmp_path))
    found = reduce_recordings([path], map_of(guessed_map([path]).encode(), path))
    assert len(found.rows) == 3 * RESTS


def test_a_guess_of_two_files_joins_them(tmp_path: Path) -> None:
    path, _ = ONE_RUN["apart_and_called_mat"](folder_of(tmp_path))
    other = path.with_name("xsens_gyro.mat")
    text_ = guessed_map([path, other])
    assert "file: {acc: gyro}" in text_
    columns = map_of(text_.encode(), path)
    assert columns.time is not None
    assert columns.time.unit == "s"
    assert "CHECK" in text_  # six attitudes of a quarter turn do not tell zero and scale of counts


def test_the_command_guesses_explains_and_reduces(tmp_path: Path, run: Run) -> None:
    path, _ = ONE_RUN["decimal_commas"](tmp_path)
    outcome = run("reduce", "--guess", path.name, "-o", "map.yaml")
    assert outcome.code == 0, outcome.err
    assert run("reduce", "--guess", path.name, "-o", "map.yaml").code == 2  # it is not written over
    assert run("reduce", path.name, "--columns", "map.yaml", "-o", "data.csv").code == 0
    lines = (tmp_path / "data.csv").read_text().splitlines()
    table = [line for line in lines if not line.startswith("#")]
    assert table[0].split(",")[-1] == "kind"
    assert sum(line.endswith(",rest") for line in table) == RESTS
    helped = run("reduce", "--map-help")
    assert helped.code == 0
    for key in ColumnMap.model_fields:
        assert re.search(rf"\b{key}\b", helped.out), key
    assert run("reduce").code == 2
    assert run("reduce", path.name, "--columns", "map.yaml").code == 2  # no -o


def test_every_map_of_these_tests_obeys_the_schema(tmp_path: Path) -> None:
    schema = column_map_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for name, lab in {**ONE_RUN, **THREE_RUNS}.items():
        folder = tmp_path / name
        folder.mkdir()
        tree = json.loads(json.dumps(read_yaml(lab(folder)[1].encode(), name).value))
        assert not list(validator.iter_errors(tree)), name
    assert list(validator.iter_errors({"gyro": {"x": 1, "y": 2, "unit": "deg/s"}}))
    assert list(validator.iter_errors({"rate": "100 Hz"}))


def test_the_examples_of_the_map_help_are_maps() -> None:
    """Each indented line of the help's first part that begins with a key is valid in a map."""
    found = re.findall(r"(?m)^(?:    |.{46})((?:gyro|acc|time|run|temperature): \{.*\})", map_help_text())
    assert len(found) >= 12
    base = {"rate": "rate: 100 Hz", "gyro": "gyro: {x: 1, y: 2, z: 3, unit: deg/s}"}
    for line in found:
        key = line.partition(":")[0]
        lines = {**base, "time": "time: {column: t, unit: s}", key: line}
        map_of("\n".join(lines.values()).encode(), Path("help.yaml"))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("scale: 0", "gyro.scale: must not be 0"),
        ("scale: 2, sensitivity: 3", "gyro.sensitivity: is 1/scale"),
        ("zero: [1, 2]", "one number, three in a list"),
        ("sensitivity: {x: 1, y: 2, w: 3}", "one number, three in a list"),
        ("file: 3", "gyro.file"),
    ],
)
def test_what_a_map_cannot_mean_is_refused(change: str, said: str) -> None:
    columns = f"rate: 100 Hz\ngyro: {{x: 1, y: 2, z: 3, unit: deg/s, {change}}}\n"
    with pytest.raises(InputError, match=said):
        map_of(columns.encode(), Path("map.yaml"))


def test_a_text_that_is_called_matlab_says_what_reads_it(tmp_path: Path) -> None:
    path, columns = ONE_RUN["apart_and_called_mat"](tmp_path)
    with pytest.raises(InputError, match=r"this is text, not matlab: write `format: text`"):
        reduce_recordings([path], map_of(("format: matlab\n" + columns).encode(), path))
