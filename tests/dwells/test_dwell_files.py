"""Dwell tables in and out of files: what goes in comes out; what cannot be meant is refused at its line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.dwells.dwell_files import dwells_bytes, read_dwells, write_dwells
from planner.errors import InputError
from planner.nouns.dwell_table import DwellTable

G = 9.80665
NAMES = [
    *("unit", "run", "day", "time_on_s", "duration_s", "temp_degc", "temp_rate_degc_min"),
    *(f"ref_rate_{axis}_dps" for axis in "xyz"),
    *(f"ref_acc_{axis}_g" for axis in "xyz"),
    *(f"gyro_{axis}_dps" for axis in "xyz"),
    *(f"acc_{axis}_g" for axis in "xyz"),
]
Rows = list[list[object]]


def rows(seed: int = 1) -> Rows:
    """Six positions, then 50 deg/s both ways about each axis, three times a run."""
    rng = np.random.default_rng(seed)
    found: Rows = []
    for run in (1, 2):
        for k in range(12):
            axis, sign = k % 3, 1 - 2 * (k // 3 % 2)
            rate = np.eye(3)[axis] * sign * 50.0 * (k >= 6)
            force = np.eye(3)[axis] * sign if k < 6 else np.eye(3)[2]
            gyro = rate + 0.1 + 0.001 * rng.normal(size=3)
            acc = force + 0.01 + 1e-4 * rng.normal(size=3)
            found.append(
                ["u1", run, float(run), 100.0 * (k + 1), 60.0, 20.0 + k / 10, 0.1, *rate, *force, *gyro, *acc]
            )
    return found


def text(table: Rows, names: list[str] = NAMES) -> str:
    lines = [",".join(names), *(",".join(str(cell) for cell in row) for row in table)]
    return "\n".join(lines) + "\n"


def read(path: Path, content: str) -> DwellTable:
    path.write_text(content)
    return read_dwells(path)


# ---------------------------------------------------------------- round trips


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".h5"])
def test_what_is_written_reads_back(tmp_path, suffix):
    table = read(tmp_path / "a.csv", text(rows()))
    write_dwells(replace(table, notes=(*table.notes, "one, with a comma")), tmp_path / f"b{suffix}")
    back = read_dwells(tmp_path / f"b{suffix}")
    for name in ("unit", "run", "day", "time_on", "duration", "temperature_degc"):
        np.testing.assert_array_equal(getattr(back, name), getattr(table, name))
    for name in ("ref_rate", "ref_acc", "gyro", "acc", "temperature_rate"):
        np.testing.assert_allclose(getattr(back, name), getattr(table, name), rtol=1e-14)  # 15 digits
    assert "one, with a comma" in back.notes
    assert back.absent == table.absent


@settings(deadline=None, max_examples=50)
@given(
    st.lists(st.floats(-1e4, 1e4).filter(lambda x: x == 0 or abs(x) > 1e-9), min_size=3, max_size=3),
    st.text(),
)
def test_any_number_and_any_name_come_back(tmp_path_factory, values, name):
    path = tmp_path_factory.mktemp("d")
    base = read(path / "a.csv", text(rows()[:1]))
    clean = "".join(c for c in name if c.isprintable()).strip() or "u"
    table = replace(base, gyro=np.radians([values]), unit=np.array([clean]), ref_rate=None, ref_acc=None)
    for suffix in (".csv", ".parquet", ".h5"):
        write_dwells(table, path / f"b{suffix}")
        back = read_dwells(path / f"b{suffix}")
        np.testing.assert_allclose(back.gyro, table.gyro, rtol=1e-13, atol=1e-300)
        assert back.unit.tolist() == [clean]


def test_the_same_table_gives_the_same_bytes(tmp_path):
    table = read(tmp_path / "a.csv", text(rows()))
    for form in ("csv", "parquet", "hdf5"):
        assert dwells_bytes(table, form) == dwells_bytes(table, form)


def test_units_are_those_of_the_columns(tmp_path):
    table = read(tmp_path / "a.csv", text(rows()))
    assert table.gyro[6] == pytest.approx(np.radians(np.array(rows()[6][13:16], dtype=float)))
    assert table.acc[0] == pytest.approx(G * np.array(rows()[0][16:19], dtype=float))
    assert table.temperature_rate[0] == pytest.approx(0.1 / 60)


def test_absent_columns_are_named(tmp_path):
    keep = [i for i, name in enumerate(NAMES) if not name.startswith(("day", "ref_acc", "temp_rate"))]
    table = read(
        tmp_path / "a.csv", text([[row[i] for i in keep] for row in rows()], [NAMES[i] for i in keep])
    )
    assert {"day", "temp_rate_degc_min", "ref_acc_x_g"} <= set(table.absent)
    assert table.ref_acc is None
    assert any("has no day" in note for note in table.notes)


def test_columns_in_any_order_with_comments(tmp_path):
    order = np.random.default_rng(1).permutation(len(NAMES))
    turned = text([[row[i] for i in order] for row in rows()], [NAMES[i] for i in order])
    plain = read(tmp_path / "a.csv", text(rows()))
    other = read(tmp_path / "b.csv", "# a comment\n# note: taken at noon\n" + turned)
    np.testing.assert_array_equal(other.gyro, plain.gyro)
    assert "taken at noon" in other.notes


# ---------------------------------------------------------------- refusals


def column(name: str, change: Callable[[float], object]) -> Callable[[Rows], None]:
    def apply(table: Rows) -> None:
        for row in table:
            for i, n in enumerate(NAMES):
                if n.startswith(name):
                    row[i] = change(float(str(row[i])))

    return apply


def cell(line: int, name: str, value: object) -> Callable[[Rows], None]:
    return lambda table: table[line].__setitem__(NAMES.index(name), value)


def swap(table: Rows) -> None:
    i, j = NAMES.index("gyro_x_dps"), NAMES.index("gyro_y_dps")
    for row in table:
        row[i], row[j] = row[j], row[i]


def same_run(table: Rows) -> None:
    for row in table[12:]:
        row[1], row[3] = 1, float(str(row[3])) + 5000.0


REFUSED: dict[str, tuple[Callable[[Rows], None], str]] = {
    "gyros in rad/s": (column("gyro", np.radians), "look like rad/s"),
    "accelerometers in m/s^2": (column("acc", lambda x: x * G), "look like m/s²"),
    "reference rate in rad/s": (column("ref_rate", np.radians), "rad/s"),
    "kelvin": (column("temp_degc", lambda x: x + 273.15), "looks like kelvin"),
    "turned sign": (column("gyro_z", lambda x: -x), "sign turned"),
    "swapped axes": (swap, "axes swapped"),
    "nan": (cell(4, "gyro_x_dps", "nan"), ":6:1  gyro_x_dps: empty or not a number"),
    "empty": (cell(4, "acc_y_g", ""), ":6:1  acc_y_g: empty"),
    "infinite": (cell(4, "acc_y_g", "inf"), ":6:1  acc_y_g: infinite"),
    "half a run": (cell(4, "run", 1.5), "1.5 is not a whole number"),
    "negative duration": (cell(4, "duration_s", -60), "negative"),
    "time runs back": (cell(4, "time_on_s", 150.0), "time runs back from 400 s to 150 s"),
    "reused run": (same_run, "every power-on needs a number of its own"),
    "doubled row": (lambda table: table.insert(5, list(table[4])), "the same as line 6; remove one"),
    "padding": (lambda t: t[4].__setitem__(slice(13, 19), [0] * 6), "looks like padding"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_what_cannot_be_meant_is_refused_at_its_place(tmp_path, fault):
    change, said = REFUSED[fault]
    table = rows()
    change(table)
    with pytest.raises(InputError) as told:
        read(tmp_path / "a.csv", text(table))
    assert said in str(told.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "is empty"),
        (",".join(NAMES) + "\n", "no rows"),
        (text(rows()) + "u1,3,1.0,5\n", "4 cells where the table has 19 columns"),
        (text(rows()).replace("gyro_x_dps", "gyro_x_dsp"), "did you mean gyro_x_dps"),
        (text(rows()).replace("acc_z_g", "foo", 2), "missing beside its other axes"),
        ("a,b\n1,2\n", "is no dwell table"),
    ],
)
def test_files_that_are_no_dwell_tables_are_refused(tmp_path, content, said):
    with pytest.raises(InputError, match=said):
        read(tmp_path / "a.csv", content)


def test_a_torn_last_line_is_left_out_and_told(tmp_path):
    whole = text(rows())
    table = read(tmp_path / "a.csv", whole[:-4])  # "…0.0101" becomes "…0.01": a number, but which?
    assert len(table) == len(rows()) - 1
    assert any("no line end" in note for note in table.notes)


def test_a_dead_channel_is_told(tmp_path):
    table = rows()
    column("acc_y", lambda x: 0.5)(table)
    keep = [i for i, name in enumerate(NAMES) if not name.startswith("ref")]
    found = read(
        tmp_path / "a.csv", text([[row[i] for i in keep] for row in table], [NAMES[i] for i in keep])
    )
    assert any("acc_y reads the same in every row" in note for note in found.notes)


def test_a_saturated_channel_is_told(tmp_path):
    table = rows()
    for row in table:
        row[NAMES.index("gyro_x_dps")] = float(np.clip(float(str(row[13])), -45.0, 45.0))
        row[NAMES.index("ref_rate_x_dps")] = float(str(row[7])) * (1 + 0.1 * float(str(row[1])))
    found = read(tmp_path / "a.csv", text(table))
    assert any("gyro_x stops at the same value" in note for note in found.notes)


@pytest.mark.parametrize("suffix", [".parquet", ".h5"])
@pytest.mark.parametrize("share", [0.1, 0.9])
def test_a_cut_binary_table_is_refused(tmp_path, suffix, share):
    write_dwells(read(tmp_path / "a.csv", text(rows())), tmp_path / f"b{suffix}")
    data = (tmp_path / f"b{suffix}").read_bytes()
    (tmp_path / f"b{suffix}").write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match="not a whole"):
        read_dwells(tmp_path / f"b{suffix}")


def test_another_suffix_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"\.csv, \.parquet or \.h5"):
        read_dwells(tmp_path / "a.xlsx")
