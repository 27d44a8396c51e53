"""What goes wrong on a bench is refused in words with exit code 2, or told of in the result."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InputError
from planner.recordings.column_map import read_map
from planner.recordings.raw_to_dwells import reduce_recordings
from tests.outcome import Run
from tests.recordings.recordings import HEADER, Array, G, save, tumbled

GOOD = tumbled(turns=(0, 1, 2, 0, 1)).readings(0.05, 0.002, 1)
MAP = """\
unit: imu7
time: {column: time_s, unit: s}
gyro: {x: gyro_x_dps, y: gyro_y_dps, z: gyro_z_dps, unit: deg/s}
acc: {x: acc_x_g, y: acc_y_g, z: acc_z_g, unit: g}
temperature: {column: temp_degc, unit: degC}
"""


def changed(change: Callable[[Array], None]) -> Array:
    values = GOOD.copy()
    change(values)
    return values


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Array:
    found = reduce_recordings([save(tmp_path_factory.mktemp("clean") / "a.csv", GOOD)])
    return np.hstack([found.table.gyro, found.table.acc])


# ---------------------------------------------------------------- refused


def swap_gyros(values: Array) -> None:
    values[:, [1, 2]] = values[:, [2, 1]]


def scaled(columns: slice, factor: float) -> Callable[[Array], None]:
    def change(values: Array) -> None:
        values[:, columns] *= factor

    return change


def kelvin(values: Array) -> None:
    values[:, 7] += 273.15


REFUSED = {
    "gyros in rad/s": (scaled(slice(1, 4), np.pi / 180), "rad/s named deg/s"),
    "accelerometers in m/s^2": (scaled(slice(4, 7), G), "m/s.2 named g"),
    "accelerometers in mg": (scaled(slice(4, 7), 1000.0), "milli-g"),
    "accelerometers in a strange unit": (scaled(slice(4, 7), 3.3), "check their unit"),
    "temperature in kelvin": (kelvin, "kelvin named degC"),
    "gyro x and y swapped": (swap_gyros, "axes do not fit.*x from y, y from x, z from z"),
    "gyro z turned": (scaled(slice(3, 4), -1.0), "axes do not fit.*x from x, y from y, z from -z"),
    "accelerometer y turned": (scaled(slice(5, 6), -1.0), "axes do not fit"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_a_mix_up_is_refused_with_a_guess(tmp_path, run: Run, fault):
    change, said = REFUSED[fault]
    save(tmp_path / "a.csv", changed(change))
    outcome = run("reduce", "a.csv", "-o", "data.csv")
    assert outcome.code == 2
    assert re.search(said, outcome.err), outcome.err
    assert not (tmp_path / "data.csv").exists()


def test_a_recording_without_a_fault_passes(tmp_path, run: Run):
    """Else the refusals here would tell nothing."""
    save(tmp_path / "a.csv", GOOD)
    (tmp_path / "map.yaml").write_text(MAP)
    assert run("reduce", "a.csv", "--columns", "map.yaml", "-o", "data.csv").code == 0
    assert run("reduce", "a.csv", "-o", "data.csv").code == 0


def test_degrees_named_radians_are_refused(tmp_path, run: Run):
    save(tmp_path / "a.csv", GOOD)
    (tmp_path / "map.yaml").write_text(MAP.replace("unit: deg/s", "unit: rad/s"))
    outcome = run("reduce", "a.csv", "--columns", "map.yaml", "-o", "data.csv")
    assert outcome.code == 2
    assert "deg/s named rad/s" in outcome.err


def test_gravity_named_metres_is_refused(tmp_path, run: Run):
    save(tmp_path / "a.csv", GOOD)
    (tmp_path / "map.yaml").write_text(MAP.replace("unit: g}", "unit: m/s^2}"))
    outcome = run("reduce", "a.csv", "--columns", "map.yaml", "-o", "data.csv")
    assert outcome.code == 2
    assert "g named m/s^2" in outcome.err


@pytest.mark.parametrize(
    ("columns", "said"),
    [([0, 2, 1], "axes swapped"), ([0, -1, 2], "sign turned"), ("m/s", "look like m/s")],
)
def test_references_show_what_the_turns_do_not(tmp_path, run: Run, columns, said):
    """Both sensors with the same wrong axes, or without turns in the record."""
    up = np.repeat(np.vstack([np.eye(3), -np.eye(3)]), 1200, axis=0)
    rng = np.random.default_rng(1)
    acc = (up * G if columns == "m/s" else turned_axes(up, columns)) + 0.002 * rng.normal(size=up.shape)
    time = np.arange(len(up)) / 200
    values = np.column_stack([time, acc, up])
    names = ",".join(["time_s", *(f"acc_{a}_g" for a in "xyz"), *(f"ref_acc_{a}_g" for a in "xyz")])
    save(tmp_path / "a.csv", values, names)
    outcome = run("reduce", "a.csv", "-o", "data.csv")
    assert outcome.code == 2
    assert said in outcome.err


def turned_axes(up: Array, columns: list[int]) -> Array:
    found = up[:, np.abs(columns)]
    return found * np.where(np.array(columns) < 0, -1.0, 1.0)


# ---------------------------------------------------------------- told of in the result


def note_of(path: Path, lines: list[str], word: str) -> tuple[str, Array]:
    path.write_text("\n".join(lines) + "\n")
    found = reduce_recordings([path])
    notes = [note for note in found.table.notes if word in note]
    assert notes, found.table.notes
    return notes[0], np.hstack([found.table.gyro, found.table.acc])


def lines_of(values: Array) -> list[str]:
    return [HEADER, *(",".join(f"{x:.9g}" for x in row) for row in values)]


NOISE = np.repeat([np.radians(0.05), 0.002 * G], 3) / np.sqrt(1000)  # of a row's mean


@pytest.mark.parametrize("end", ["7.9,0.3,-0.2,0.1,0.01,-0.", "7.9,0.3,-0.2,0.1,0.01,-0.02,1.005,2"])
def test_a_torn_last_line_is_left_out_and_told(tmp_path, clean, end):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines_of(GOOD)) + "\n" + end)  # no line end
    found = reduce_recordings([path])
    assert any("1 torn last line" in note or "1 unreadable row" in note for note in found.table.notes)
    np.testing.assert_array_equal(np.hstack([found.table.gyro, found.table.acc]), clean)


def test_ragged_rows_are_left_out_with_their_lines(tmp_path, clean):
    lines = lines_of(GOOD)
    lines[300], lines[700] = "1.495,0.3,-0.2", lines[700] + ",9"
    note, rows = note_of(tmp_path / "a.csv", lines, "unreadable")
    assert "2 unreadable row" in note
    assert (np.abs(rows - clean) < NOISE).all()
    found = reduce_recordings([tmp_path / "a.csv"])
    assert any(":301:" in note for note in found.table.notes)


@pytest.mark.parametrize("cell", ["nan", "inf", "-inf", "NaN", ""])
def test_cells_that_are_no_numbers_are_counted(tmp_path, clean, cell):
    lines = lines_of(GOOD)
    for number in (200, 205, 900):
        cells = lines[number].split(",")
        cells[2] = cell
        lines[number] = ",".join(cells)
    note, rows = note_of(tmp_path / "a.csv", lines, "not finite")
    assert "3 not finite" in note
    assert (np.abs(rows - clean) < NOISE).all()


def test_a_time_that_is_no_number_is_counted(tmp_path, clean):
    lines = lines_of(GOOD)
    lines[200] = "nan," + lines[200].split(",", 1)[1]
    note, rows = note_of(tmp_path / "a.csv", lines, "time not rising")
    assert "1 time not rising" in note
    assert (np.abs(rows - clean) < NOISE).all()


def test_zero_padding_is_left_out(tmp_path, clean):
    values = changed(lambda v: v.__setitem__((slice(500, 540), slice(1, 7)), 0.0))
    note, rows = note_of(tmp_path / "a.csv", lines_of(values), "zero padding")
    assert "40 zero padding" in note
    assert (np.abs(rows - clean) < NOISE).all()


def test_duplicated_rows_count_once(tmp_path, clean):
    lines = lines_of(GOOD)
    lines[300:300] = lines[295:300]
    note, rows = note_of(tmp_path / "a.csv", lines, "time not rising")
    assert "5 time not rising" in note
    np.testing.assert_array_equal(rows, clean)


def test_repeated_samples_are_told_without_a_clock(tmp_path):
    values = GOOD.copy()
    values[300:500] = values[300]
    (tmp_path / "map.yaml").write_text(MAP.replace("time: {column: time_s, unit: s}", "rate: 200 Hz"))
    found = reduce_recordings([save(tmp_path / "a.csv", values)], read_map(tmp_path / "map.yaml"))
    assert any("199 samples repeat the one before" in note for note in found.table.notes)


def test_a_clock_that_was_set_back_is_refused(tmp_path, run: Run):
    values = changed(lambda v: v.__setitem__((slice(4000, None), 0), v[4000:, 0] - 15.0))
    save(tmp_path / "a.csv", values)
    outcome = run("reduce", "a.csv", "-o", "data.csv")
    assert outcome.code == 2
    assert "was the clock set" in outcome.err


def test_a_constant_channel_is_told(tmp_path):
    values = changed(lambda v: v.__setitem__((slice(None), 2), 0.123456))
    note, _ = note_of(tmp_path / "a.csv", lines_of(values), "reads the same in every sample")
    assert note.startswith("gyro_y")
    assert "in 5 rows" in note  # the turn about y, under which gravity stays, is seen by no other channel


def test_a_saturated_channel_is_told(tmp_path):
    values = changed(lambda v: v.__setitem__((slice(None), slice(1, 4)), np.clip(v[:, 1:4], -100, 100)))
    note, _ = note_of(tmp_path / "a.csv", lines_of(values), "saturated")
    assert "stands at its extreme" in note


def test_a_full_scale_of_the_map_is_watched(tmp_path):
    (tmp_path / "map.yaml").write_text(MAP + "full_scale: {acc: 1 g}\n")
    found = reduce_recordings([save(tmp_path / "a.csv", GOOD)], read_map(tmp_path / "map.yaml"))
    assert any("acc_z reaches its full scale" in note for note in found.table.notes)


# ---------------------------------------------------------------- files, maps, options


def test_every_other_bad_input_ends_with_code_2_and_a_sentence(tmp_path, run: Run):
    save(tmp_path / "good.csv", GOOD)
    save(tmp_path / "unnamed.csv", GOOD, "a,b,c,d,e,f,g,h")
    save(tmp_path / "moving.csv", changed(lambda v: v.__setitem__((slice(None), slice(1, 7)), jerk(len(v)))))
    save(tmp_path / "short.csv", GOOD[:3])
    save(tmp_path / "near.csv", GOOD, HEADER.replace("gyro_x_dps", "gyro_x_dsp"))
    save(tmp_path / "dwells.csv", GOOD, HEADER.replace("time_s", "run").replace("temp_degc", "duration_s"))
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "packet.bin").write_bytes(b"\x1b" + b"\0" * 20)
    (tmp_path / "map.yaml").write_text(MAP)
    (tmp_path / "key.yaml").write_text(MAP.replace("temperature:", "temprature:"))
    (tmp_path / "axis.yaml").write_text(MAP.replace("gyro_y_dps", "gyro_yy_dps"))
    (tmp_path / "unit.yaml").write_text(MAP.replace("unit: deg/s", "unit: deg"))
    (tmp_path / "clock.yaml").write_text(MAP + "rate: 20 Hz\n")
    (tmp_path / "no_rate.yaml").write_text(MAP.replace("time: {column: time_s, unit: s}\n", ""))
    (tmp_path / "list.yaml").write_text("- a\n")
    for arguments, said in [
        (("absent.csv",), "cannot read absent.csv"),
        (("empty.csv",), "is empty"),
        (("packet.bin",), "no format|not one whole packet"),
        (("unnamed.csv",), "say with --columns.*a, b, c"),
        (("short.csv",), "shorter than 1 s"),
        (("near.csv",), "'gyro_x_dsp' is nearly 'gyro_x_dps'|no column 'gyro_x_dps' beside"),
        (("dwells.csv",), "is a dwell table already"),
        (("moving.csv",), "nothing gives a row"),
        (("good.csv", "good.csv"), "given twice"),
        (("good.csv", "--columns", "absent.yaml"), "cannot read absent.yaml"),
        (("good.csv", "--columns", "key.yaml"), "temprature: unknown key; did you mean 'temperature'"),
        (("good.csv", "--columns", "axis.yaml"), "no column 'gyro_yy_dps'; did you mean 'gyro_y_dps'"),
        (("good.csv", "--columns", "unit.yaml"), "gyro.unit: 'deg' has the wrong dimension"),
        (("good.csv", "--columns", "clock.yaml"), "the map says 20 Hz, the time column 200 Hz"),
        (("good.csv", "--columns", "no_rate.yaml"), "rate: missing"),
        (("good.csv", "--columns", "list.yaml"), "no map of columns"),
        (("good.csv", "--plan", "absent.json"), "cannot read absent.json"),
        (("good.csv", "--latitude", "50"), "give the plan"),
        (("dwells.csv", "--guess"), "is a dwell table already"),
    ]:
        outcome = run("reduce", *arguments, "-o", "data.csv", "--json")
        assert outcome.code == 2, (arguments, outcome.err)
        assert re.search(said, outcome.err), (arguments, outcome.err)
        assert "Traceback" not in outcome.err
        assert outcome.envelope["exit_code"] == 2
        assert not (tmp_path / "data.csv").exists()


def jerk(rows: int) -> Array:
    """No rest anywhere: every channel jumps each 35 ms."""
    rng = np.random.default_rng(3)
    levels = np.cumsum(rng.normal(size=(rows // 7 + 1, 6)) * [50, 50, 50, 1, 1, 1], axis=0)
    return np.repeat(levels, 7, axis=0)[:rows]


@pytest.mark.parametrize("out", ["good.csv", "map.yaml", "data.txt2"])
def test_no_input_is_overwritten(tmp_path, run: Run, out):
    save(tmp_path / "good.csv", GOOD)
    (tmp_path / "map.yaml").write_text(MAP)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    outcome = run("reduce", "good.csv", "--columns", "map.yaml", "-o", out)
    assert outcome.code == 2
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_one_recording_under_two_names_is_refused(tmp_path, run: Run):
    save(tmp_path / "a.csv", GOOD)
    save(tmp_path / "b.csv", GOOD)
    outcome = run("reduce", "a.csv", "b.csv", "-o", "data.csv")
    assert outcome.code == 2
    assert "b.csv holds the same samples as a.csv" in outcome.err


@settings(deadline=None, max_examples=40)
@given(st.data())
def test_any_damage_to_the_text_is_read_or_refused(tmp_path_factory, data):
    """Bytes are changed, cut out or put in anywhere: a result with its account, or an InputError."""
    path = tmp_path_factory.mktemp("d") / "a.csv"
    text = bytearray("\n".join(lines_of(GOOD[:1400])).encode() + b"\n")
    for _ in range(data.draw(st.integers(1, 6))):
        place = data.draw(st.integers(0, len(text) - 1))
        kind = data.draw(st.sampled_from(["change", "cut", "put"]))
        if kind == "change":
            text[place] = data.draw(st.integers(0, 255))
        elif kind == "cut":
            del text[place : place + data.draw(st.integers(1, 200))]
        else:
            text[place:place] = data.draw(st.binary(min_size=1, max_size=30))
    path.write_bytes(text)
    try:
        found = reduce_recordings([path])
    except InputError:
        return
    assert np.isfinite(found.table.gyro).all()
    told = sum(r.n_samples + sum(r.left_out.values()) for r in found.rows) + sum(
        p.samples for p in found.left_out
    )
    assert told == next(iter(found.counts.values()))["read"]
