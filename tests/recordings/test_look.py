"""`planner look`: what is in a recording, what is odd in it, and the map that reads it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.recordings.column_map import map_of
from planner.recordings.look import look
from planner.recordings.raw_to_dwells import reduce_recordings
from tests.outcome import Run
from tests.recordings.labs import COLUMNS, PLAIN, RESTS, THREE_RUNS, readings, rows, text
from tests.recordings.recordings import G


def silent(_: str) -> None:
    return None


@pytest.mark.charts
def test_the_page_and_the_map_are_written(tmp_path: Path, run: Run) -> None:
    text(tmp_path / "a.csv", [",".join(COLUMNS), *rows(readings())])
    outcome = run("look", "a.csv", "--json")
    assert outcome.code == 0, outcome.err
    (power_on,) = outcome.json["power_ons"]
    assert len(power_on["rests"]) == RESTS
    assert power_on["turns"] == RESTS - 1
    assert power_on["rate_hz"] == pytest.approx(100.0, rel=1e-3)
    np.testing.assert_allclose(power_on["gravity_g"], 1.0, atol=0.03)
    assert power_on["findings"] == []
    page = (tmp_path / "looks" / "a" / "report.html").read_text()
    for word in (
        "What is odd",
        "Signals",
        "rest_001",
        "gyros, deg/s",
        "The map that reads it",
        "gyro: {x: gx",
    ):
        assert word in page
    assert run("reduce", "a.csv", "--columns", "looks/a/map.yaml", "-o", "data.csv").code == 0


def test_what_is_odd_is_found_and_not_refused(tmp_path: Path) -> None:
    values = readings()
    values[:, 4:] *= G  # named g by the map
    values[:, 2] = 0.25
    values[900:, 0] += 40.0
    lines = [",".join(COLUMNS), *rows(values)]
    lines[300] += ",7"
    path = text(tmp_path / "a.csv", lines)
    (tmp_path / "map.yaml").write_text(PLAIN)
    found = look([path], tmp_path / "map.yaml", silent)
    (one,) = found.power_ons
    said = " ".join(one.findings)
    assert "look like m/s^2 named g" in said
    assert "gyro_y never changes" in said
    assert "1 samples left out while reading: unreadable row" in said
    (gap,) = one.gaps
    assert gap.seconds == pytest.approx(40.0, abs=0.1)
    assert not found.guessed


def test_power_ons_are_looked_at_one_by_one(tmp_path: Path) -> None:
    path, _ = THREE_RUNS["by_the_clock"](tmp_path)
    found = look([path], None, silent)
    assert [len(one.rests) for one in found.power_ons] == [RESTS] * 3
    assert found.guessed


# ---------------------------------------------------------------- which rests are rests


def test_a_rest_that_is_not_quiet_is_none(tmp_path: Path) -> None:
    """In the third rest the hand sways: each window is as quiet as others, the rest as a whole is not."""
    values = readings()
    third = slice(830, 1090)
    sway = 0.012 * np.sin(2 * np.pi * 0.7 * values[third, 0])  # six times the noise, over 1.4 s
    values[third, 4:] += sway[:, None]
    path = text(tmp_path / "a.csv", [",".join(COLUMNS), *rows(values)])
    found = reduce_recordings([path], map_of(PLAIN.encode(), path))
    spread = found.table.acc_std.max(axis=1)
    assert (spread < 2.5 * np.median(spread)).all()
    kept = [row for row in found.rows if 8.3 < row.start < 10.9]
    assert not kept
    reasons = " ".join(part.reason for part in found.left_out)
    assert "is not quiet" in reasons or "moves" in reasons


@pytest.mark.parametrize("shortest", [0.5, 2.0, 2.5, 3.5])
def test_no_row_is_shorter_than_the_shortest(tmp_path: Path, shortest: float) -> None:
    path = text(tmp_path / "a.csv", [",".join(COLUMNS), *rows(readings())])
    columns = map_of((PLAIN + f"shortest: {shortest} s\n").encode(), path)
    if shortest > 3.0:
        with pytest.raises(Exception, match=r"shorter than 3.5 s"):
            reduce_recordings([path], columns)
        return
    found = reduce_recordings([path], columns)
    assert found.table.duration.min() >= shortest


# ---------------------------------------------------------------- apply, and files of others


def test_apply_takes_every_power_on_of_a_file(tmp_path: Path, run: Run) -> None:
    from tests.data import HERE
    from tests.specs import SHIPPED

    spec = SHIPPED / "close_the_loop.yaml"
    made = run("calibrate", HERE / "imu0.csv", "--spec", spec, "--method", "free_orientations", "-o", "cal")
    assert made.code == 0, made.err
    path, columns = THREE_RUNS["by_a_column"](tmp_path)
    (tmp_path / "map.yaml").write_text(columns)
    outcome = run("apply", "cal", path.name, "--columns", "map.yaml", "-o", "out.csv", "--json")
    assert outcome.code == 0, outcome.err
    found = np.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True)
    assert sorted(set(found["run"].tolist())) == [1, 2, 3]
    assert len(found) == outcome.json["rows"] == 3 * len(readings())


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        (
            "a.csv",
            b"PK\x03\x04 [Content_Types].xml xl/workbook.xml",
            "an Excel workbook; save the sheet as CSV",
        ),
        ("a.csv", b"\x1f\x8b\x08\x00" + b"\0" * 50, "packed by gzip; unpack it first"),
        ("a.bag", b"#ROSBAG V2.0\n" + b"\0" * 50, "a ROS bag; write its topic to CSV"),
        ("a.json", b'{"acc": [[1, 2, 3]]}', "JSON; write its arrays as columns"),
        ("a.mat", b"%PDF-1.4\n", "a PDF"),
    ],
)
def test_a_file_of_another_kind_is_named(
    tmp_path: Path, run: Run, name: str, content: bytes, said: str
) -> None:
    (tmp_path / name).write_bytes(content)
    for arguments in (("reduce", name, "-o", "d.csv"), ("reduce", "--guess", name), ("look", name)):
        outcome = run(*arguments)
        assert outcome.code == 2
        assert said in outcome.err
