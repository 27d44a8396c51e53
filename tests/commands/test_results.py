"""`planner sensitivity`, `allow` and `compare` from outside."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import pytest

from tests.commands.specs import flown, written
from tests.documents import keeps
from tests.outcome import Run
from tests.specs import planned, small, with_limit

# ---------------------------------------------------------------- sensitivity, allow


def test_sensitivity_lists_every_axis_in_its_unit(run: Run, tmp_path: Path) -> None:
    columns = run("sensitivity", written(tmp_path / "s.yaml", flown()), "--json").json["columns"]
    keys = {"error", "axis", "per", "north_m", "east_m", "up_m", "north_mps", "roll_deg", "heading_deg"}
    assert all(keys <= set(column) for column in columns)
    assert {(c["error"], c["per"]) for c in columns} >= {
        ("gyro.bias", "deg/s"),
        ("accelerometer.bias", "g"),
        ("gyro.scale_factor", "1"),
        ("accelerometer.scale_factor", "1"),
    }


def test_sensitivity_of_an_accelerometer_bias_is_half_a_t_squared(run: Run, tmp_path: Path) -> None:
    columns = run("sensitivity", written(tmp_path / "s.yaml", flown()), "--json").json["columns"]
    x = next(c for c in columns if c["error"] == "accelerometer.bias" and c["axis"] == "x")
    free_fall = 9.80665 * 20.0**2 / 2  # m per g
    # Schuler's oscillation takes (20 s / 806 s)² / 12 = 5e-5 away, the Earth's rotation as little
    assert math.hypot(x["north_m"], x["east_m"]) == pytest.approx(free_fall, rel=2e-4)


def test_sensitivity_on_a_flight_that_is_not_there(run: Run, spec: Path) -> None:
    found = run("sensitivity", spec, "--trajectory", "nowhere.csv")
    assert (found.code, found.out) == (2, "")
    assert "nowhere.csv" in found.err


@pytest.mark.charts
def test_sensitivity_writes_the_error_over_the_flight_and_other_flights(run: Run, tmp_path: Path) -> None:
    spec = written(tmp_path / "s.yaml", flown())
    found = run("sensitivity", spec, "--beside", "static", "-o", tmp_path / "out", "--json")
    first, second = found.json["flights"]
    assert first["time_s"] == second["time_s"] == 20.0
    assert all(e["ratio"] == 1.0 for e in first["errors"] if e["ratio"] is not None)
    rows = list(csv.DictReader((tmp_path / "out" / "sensitivities.csv").open()))
    last = [row for row in rows if float(row["time_s"]) == 20.0]
    for row, column in zip(last, found.json["columns"], strict=True):
        assert (row["error"], row["axis"]) == (column["error"], column["axis"])
        assert float(row["north_m"]) == pytest.approx(column["north_m"], rel=1e-8)
    page = (tmp_path / "out" / "report.html").read_text()
    assert "The error over the time of flight" in page
    assert "by axis of the unit" in page


def test_sensitivity_beside_a_flight_that_is_not_there(run: Run, spec: Path) -> None:
    found = run("sensitivity", spec, "--beside", "helicoptr")
    assert (found.code, found.out) == (2, "")
    assert "--beside helicoptr" in found.err
    assert "did you mean" in found.err


def test_allow_prints_corners_and_json(run: Run, spec: Path) -> None:
    text, document = run("allow", spec), run("allow", spec, "--json")
    assert (text.code, document.code) == (0, 0)
    assert "gyro.bias" in text.out
    assert document.json


# ---------------------------------------------------------------- compare


@pytest.fixture(scope="module")
def two_plans(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    from planner.export.json import plan_text

    folder = tmp_path_factory.mktemp("plans")
    for name, limit in (("one", "10 m"), ("two", "9 m")):
        (folder / name).mkdir()
        made = planned(with_limit(small(), limit)).plan
        (folder / name / "plan.json").write_text(plan_text(made), encoding="utf-8")
    return folder / "one", folder / "two"


def test_compare_tells_equal_plans_from_different_ones(run: Run, two_plans: tuple[Path, Path]) -> None:
    one, two = two_plans
    assert run("compare", one, one / "plan.json", "--exit-code").code == 0
    assert run("compare", one, two).code == 0
    different = run("compare", one, two, "--exit-code", "--json")
    assert different.code == 1
    assert different.json["differ"] is True
    keeps(different.json, "compare")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"[1]", "not a plan"),
        (b"{}", "not a plan"),
        (b"\xff\xfe\x00", "not a plan"),
        (b"[" * 100_000, "not a plan"),
    ],
    ids=["empty", "list", "no keys", "binary", "nested"],
)
def test_what_is_no_plan_is_exit_2(
    content: bytes, words: str, run: Run, two_plans: tuple[Path, Path], tmp_path: Path
) -> None:
    (tmp_path / "no.json").write_bytes(content)
    found = run("compare", "no.json", two_plans[0])
    assert (found.code, found.out) == (2, "")
    assert words in found.err
    assert "no.json" in found.err


@pytest.mark.parametrize("key", ["steps", "requirements", "tests", "time_s", "spec"])
@pytest.mark.parametrize("value", [5, None, "x", [None], [{}]], ids=str)
def test_a_plan_with_a_broken_part_is_exit_2(
    key: str, value: object, run: Run, two_plans: tuple[Path, Path], tmp_path: Path
) -> None:
    document = json.loads((two_plans[0] / "plan.json").read_text(encoding="utf-8"))
    if key == "time_s" and value == 5:
        pytest.skip("a possible time")
    (tmp_path / "no.json").write_text(json.dumps(document | {key: value}))
    found = run("compare", two_plans[0], "no.json")
    assert (found.code, found.out) == (2, "")
    assert key in found.err


def test_one_plan_cannot_be_compared(run: Run, two_plans: tuple[Path, Path]) -> None:
    assert run("compare", two_plans[0]).code == 2
    assert run("compare", two_plans[0], "nowhere").code == 2
