"""What is wrong with a trajectory file is said with its line; nothing wrong passes silently."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InputError
from planner.nouns.array import Array
from tests.trajectories.flights import HEADER, flight, table, write


@pytest.fixture(scope="module")
def rows() -> Array:
    return table(flight("helicopter", duration="40 s", sampling_rate="20 Hz"))


def refused(path: Path) -> InputError:
    with pytest.raises(InputError) as caught:
        flight("file", file=str(path))
    assert caught.value.exit_code == 2
    assert all(fault.file == path.name for fault in caught.value.faults)
    return caught.value


def first(error: InputError) -> tuple[int, int, str]:
    fault = error.faults[0]
    return fault.line, fault.column, fault.message


def lines(rows: Array) -> list[str]:
    return [",".join(HEADER), *(",".join(f"{x:.9f}" for x in row) for row in rows)]


def save(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


# ---------------------------------------------------------------- text


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "is empty"),
        ("\n\n\n", "is empty"),
        ("# only\n# comments\n", "is empty"),
        (",".join(HEADER) + "\n", "no rows"),
        (",".join(HEADER) + "\n0,50,30,0,0,0,0,0,0,0\n", "one row"),
        ("0,50,30,0,0,0,0,0,0,0\n1,50,30,0,0,0,0,0,0,0\n", "header is missing"),
        (";".join(HEADER) + "\n0;50;30;0;0;0;0;0;0;0\n", "separated by commas"),
        (b"\x89HDF\r\n\x1a\n\0\0\0\0", "binary"),
        (b"\xff\xfe\xfd time", "not UTF-8"),
        ("x" * 100_000, "too long"),
        (",".join(HEADER) + "\n" + "1" * 3_000_000, "no line end"),
    ],
)
def test_what_is_no_table_is_refused(content: str | bytes, says: str, tmp_path: Path) -> None:
    assert says in str(refused(save(tmp_path / "flight.csv", content)))


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    assert "no such file" in str(refused(tmp_path / "none.csv"))
    (tmp_path / "folder.csv").mkdir()
    assert "is a folder" in str(refused(tmp_path / "folder.csv"))


def test_all_faults_of_the_header_are_said_at_once(tmp_path: Path, rows: Array) -> None:
    text = lines(rows)
    text[0] = "# made\n" + text[0].replace("lat_deg", "latdeg").replace("v_east_mps", "v_north_mps")
    error = refused(save(tmp_path / "flight.csv", "\n".join(text) + "\n"))
    said = {(fault.line, fault.column, fault.path): fault.message for fault in error.faults}
    assert said[2, 2, "latdeg"] == "unknown column; did you mean lat_deg?"
    assert "twice" in said[2, 6, "v_north_mps"]
    assert "missing" in said[2, 1, "lat_deg"]
    assert "missing" in said[2, 1, "v_east_mps"]
    assert len(said) == 4


@pytest.mark.parametrize(
    "bad", ["nan", "inf", "-inf", "1e999", "abc", "", "1.2.3", "--1", "1_0", "0x10", "'1'"]
)
def test_what_is_no_finite_number_is_refused_with_its_place(bad: str, tmp_path: Path, rows: Array) -> None:
    text = lines(rows)
    fields = text[101].split(",")
    fields[3] = bad
    text[101] = ",".join(fields)
    error = refused(save(tmp_path / "flight.csv", "\n".join(text) + "\n"))
    assert first(error)[:2] == (102, 4)
    assert "not a finite number" in first(error)[2]


@pytest.mark.parametrize("cut", [1, 5])
def test_too_few_and_too_many_values_in_a_row_are_refused(cut: int, tmp_path: Path, rows: Array) -> None:
    text = lines(rows)
    text[50] = ",".join(text[50].split(",")[:-cut])
    text[60] += ",0.0"
    error = refused(save(tmp_path / "flight.csv", "\n".join(text) + "\n"))
    assert [(fault.line, fault.message[:2]) for fault in error.faults] == [
        (51, f"{10 - cut} "[:2]),
        (61, "11"),
    ]


def test_not_more_than_twenty_faults_are_said(tmp_path: Path, rows: Array) -> None:
    text = [line.replace(",", ";", 1) if k else line for k, line in enumerate(lines(rows))]
    assert len(refused(save(tmp_path / "flight.csv", "\n".join(text) + "\n")).faults) == 20


def test_a_file_torn_anywhere_in_its_last_line_is_refused_or_read_without_harm(
    tmp_path: Path, rows: Array
) -> None:
    """Cut after every byte of the last line; only the whole line passes."""
    whole = "\n".join(lines(rows)) + "\n"
    last = len(lines(rows)[-1])
    expected = flight("file", file=str(save(tmp_path / "whole.csv", whole)))
    for missing in range(2, last):
        path = save(tmp_path / "torn.csv", whole[:-missing])
        refused(path)
    passed = flight("file", file=str(save(tmp_path / "whole.csv", whole[:-1])))
    np.testing.assert_array_equal(passed.velocity_increment, expected.velocity_increment)


@settings(deadline=None, max_examples=25)
@given(cut=st.integers(2, 16), seed=st.integers(0, 2**32 - 1))
def test_a_torn_number_of_any_length_does_no_harm(
    cut: int, seed: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Numbers of shortest form differ in length, so a cut may leave a plausible one, nearly right."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 5.0, 0.05)
    heading = 100.0 + np.cumsum(rng.normal(0, 1, len(t))) * 0.05
    text = [",".join(HEADER)] + [
        f"{s!r},50,30,0,0,0,0,0,0,{h!r}" for s, h in zip(t.tolist(), heading.tolist(), strict=True)
    ]
    field = text[-1].rsplit(",", 1)[1]
    kept = field[: max(1, len(field) - cut)]
    path = tmp_path_factory.mktemp("torn") / "flight.csv"
    save(path, "\n".join(text)[: len("\n".join(text)) - len(field) + len(kept)])
    if abs(float(kept) - heading[-1]) > 0.5:
        assert "cut off" in str(refused(path))


# ---------------------------------------------------------------- times


@pytest.mark.parametrize(
    ("change", "line", "says"),
    [
        (lambda r: r[100].__setitem__(0, r[99, 0]), 102, "repeats"),
        (lambda r: r[100].__setitem__(0, 1.0), 102, "is before"),
        (lambda r: r[100:, 0].__iadd__(0.5), 102, "a gap of 0.55 s"),
        (lambda r: r[100].__setitem__(0, r[99, 0] + 1e-4), 102, "only 0.0001 s after"),
    ],
)
def test_times_that_do_not_run_on_are_refused(
    change: Callable[[Array], None], line: int, says: str, tmp_path: Path, rows: Array
) -> None:
    bad = rows.copy()
    change(bad)
    error = refused(write(tmp_path / "flight.csv", bad))
    assert (first(error)[0], first(error)[1]) == (line, 1)
    assert says in first(error)[2]


def test_lines_are_counted_with_comments_and_blanks(tmp_path: Path, rows: Array) -> None:
    text = lines(rows)
    text[11] = text[11].replace(text[11].split(",")[0], text[10].split(",")[0], 1)
    text.insert(5, "")
    error = refused(save(tmp_path / "flight.csv", "# one\n# two\n" + "\n".join(text) + "\n"))
    assert first(error)[0] == 15
    assert "repeats" in first(error)[2]


def test_a_row_every_three_seconds_is_too_coarse(tmp_path: Path, rows: Array) -> None:
    assert "a gap of 3 s" in str(refused(write(tmp_path / "flight.csv", rows[::60])))


# ---------------------------------------------------------------- values


@pytest.mark.parametrize(
    ("column", "value", "says"),
    [
        ("lat_deg", 90.5, "not between -90 and 90"),
        ("lon_deg", 400.0, "not between -360 and 360"),
        ("alt_m", 2e6, "not between"),
        ("v_down_mps", 3e5, "not between"),
        ("roll_deg", 720.0, "not between"),
        ("pitch_deg", 90.5, "not between -90 and 90"),
        ("heading_deg", -400.0, "not between"),
    ],
)
def test_impossible_values_are_refused(
    column: str, value: float, says: str, tmp_path: Path, rows: Array
) -> None:
    bad = rows.copy()
    bad[200, HEADER.index(column)] = value
    error = refused(write(tmp_path / "flight.csv", bad))
    assert first(error)[:2] == (202, 1 + HEADER.index(column))
    assert says in first(error)[2]


@pytest.mark.parametrize(("column", "metres"), [("lat_deg", 3.0), ("lon_deg", -10.0), ("alt_m", 50.0)])
def test_a_jump_of_the_position_is_refused_with_its_size(
    column: str, metres: float, tmp_path: Path, rows: Array
) -> None:
    bad = rows.copy()
    per_metre = {"lat_deg": 1 / 111_229.0, "lon_deg": 1 / 71_695.0, "alt_m": 1.0}[column]
    bad[300:, HEADER.index(column)] += metres * per_metre
    error = refused(write(tmp_path / "flight.csv", bad))
    assert first(error)[:2] == (302, 1 + HEADER.index(column))
    assert "jumps" in first(error)[2]
    jump = float(first(error)[2].split("jumps ")[1].split(" m")[0])
    assert abs(jump) == pytest.approx(abs(metres), rel=0.02)


def test_a_spike_of_the_velocity_is_refused(tmp_path: Path, rows: Array) -> None:
    bad = rows.copy()
    bad[300, 4] += 1000.0
    error = refused(write(tmp_path / "flight.csv", bad))
    assert any("velocity jumps by +1000" in fault.message and fault.line == 302 for fault in error.faults)


def test_an_attitude_that_tumbles_between_rows_is_refused(tmp_path: Path, rows: Array) -> None:
    bad = rows.copy()
    bad[240:, 9] = (bad[240:, 9] + 150.0) % 360.0  # in hover
    error = refused(write(tmp_path / "flight.csv", bad))
    assert first(error)[0] == 242
    assert "turns by 150 deg" in first(error)[2]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda r: r[:, 6].__imul__(-1.0), "v_down_mps"),  # up instead of down
        (lambda r: r[:, 4:7].__imul__(3.6), "units and signs"),  # km/h
        (lambda r: r[:, 3].__imul__(3.28), "v_down_mps"),  # feet
        (lambda r: r[:, [4, 5]].__setitem__(slice(None), r[:, [5, 4]]) or _swap(r), "units and signs"),
        (lambda r: r[:, 1:3].__imul__(np.pi / 180.0), "radians"),
    ],
)
def test_wrong_units_signs_and_columns_are_noticed(
    change: Callable[[Array], None], says: str, tmp_path: Path
) -> None:
    bad = table(flight("helicopter", heading="20 deg", sampling_rate="20 Hz"))
    change(bad)
    assert says in str(refused(write(tmp_path / "flight.csv", bad)))


def _swap(rows: Array) -> None:
    rows[:, [4, 5]] = rows[:, [5, 4]]


def test_attitude_in_radians_is_noticed(tmp_path: Path) -> None:
    bad = table(flight("level", heading="60 deg", sampling_rate="20 Hz"))
    bad[:, 7:10] = np.radians(bad[:, 7:10])
    assert "attitude is in radians" in str(refused(write(tmp_path / "flight.csv", bad)))


def test_too_many_rows_are_refused_without_being_read(tmp_path: Path) -> None:
    save(tmp_path / "flight.csv", ",".join(HEADER).encode() + b"\n" + b"\n" * 2_020_000)
    assert "more than 2,000,000 rows" in str(refused(tmp_path / "flight.csv"))


# ---------------------------------------------------------------- anything


@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_a_mutilated_file_is_read_or_refused_and_never_a_traceback(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    text = bytearray(
        "\n".join(lines(table(flight("turn", duration="2 s", sampling_rate="10 Hz")))).encode() + b"\n"
    )
    for _ in range(data.draw(st.integers(1, 4))):
        begin = data.draw(st.integers(0, len(text)))
        end = min(len(text), begin + data.draw(st.integers(0, 40)))
        text[begin:end] = data.draw(
            st.binary(max_size=8) | st.sampled_from([b",", b"\n", b"9e9", b"#", b"-"])
        )
    path = save(tmp_path_factory.mktemp("fuzz") / "flight.csv", bytes(text))
    try:
        trajectory = flight("file", file=str(path))
    except InputError:
        return
    assert np.isfinite(trajectory.velocity_increment).all()
    assert np.isfinite(trajectory.angle_increment).all()
