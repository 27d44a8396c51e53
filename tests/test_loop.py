"""The loop closed on the command line: the lines of the README, run as they stand there."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from planner.information import pareto
from planner.spec.load import load_spec
from tests.outcome import Run
from tests.specs import ROOT, SHIPPED

SPEC = SHIPPED / "close_the_loop.yaml"


@pytest.fixture(autouse=True)
def _shipped_specs(tmp_path: Path) -> None:
    """The folder of the test has the shipped specs, as the README's lines want them."""
    (tmp_path / "requirements_specs").symlink_to(SHIPPED)


def lines_of_the_readme() -> list[list[str]]:
    """The commands of the section "Close the loop", as a shell splits them."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    section = text.split("## Close the loop")[1].split("\n## ")[0]
    block = re.search(r"```sh\n(.*?)```", section, re.DOTALL)  # the first: the second is of a real unit
    assert block is not None
    return [shlex.split(line) for line in block[1].splitlines()]


def test_the_lines_of_the_readme_close_the_loop(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for few in ("GENERATIONS", "SHOWN"):  # nothing here looks at the genetic campaign beside the plan
        monkeypatch.setattr(pareto, few, 3)
    lines = lines_of_the_readme()
    assert [line[0] for line in lines] == ["planner", "awk", "planner", "planner", "planner"]
    assert [line[1] for line in lines if line[0] == "planner"] == ["simulate", "diagnose", "update", "plan"]
    for line in lines:
        if line[0] == "awk":
            with (tmp_path / line[-1]).open("wb") as out:
                # all but the file to read, `>`, and the file to write
                subprocess.run([*line[:-3], tmp_path / line[-3]], stdout=out, check=True)
        else:
            outcome = run(*line[1:])
            assert outcome.code == 0, outcome.err
    diagnosis = json.loads((tmp_path / "loop/diagnosis/diagnosis.json").read_text(encoding="utf-8"))
    assert diagnosis["verdict"] == "explained"
    assert {e["effect"] for e in diagnosis["effects"]} == {"g_sensitivity"}
    assert [e["channels"] for e in diagnosis["effects"]] == [["gyro_y"]]
    _coefficients_are_the_truth(diagnosis, {"yx": 0.0, "yy": 0.0, "yz": 0.01})
    _error_before_and_after(diagnosis)
    _new_plan(tmp_path, diagnosis)


def _coefficients_are_the_truth(diagnosis: Any, hidden: dict[str, float]) -> None:
    for effect in diagnosis["effects"]:
        for term in effect["terms"]:
            low, high = term["ci95"]
            # an interval may miss by a little, not by as much as it is wide
            assert low - (high - low) <= hidden[term["name"]] <= high + (high - low)


def _error_before_and_after(diagnosis: Any) -> None:
    channels = {c for e in diagnosis["effects"] for c in e["channels"]}
    for channel in channels:
        change = diagnosis["residual"][channel]
        assert change["held_out"]
        assert change["within_run_after"] < change["within_run_before"]
        assert change["after"]["rms"] < change["before"]["rms"]
    flight = diagnosis["navigation"]
    assert flight["before"] > 10.0 > flight["after"] > 0.0
    assert flight["unit"] == "m"


def _new_plan(folder: Path, diagnosis: Any) -> None:
    new = load_spec(folder / "loop/spec2.yaml")
    assert new.warnings == ()
    assert "g_sensitivity" in new.spec.effects
    assert load_spec(SPEC).sha256 == diagnosis["spec"]["sha256"]
    assert diagnosis["spec"]["sha256"] in (folder / "loop/spec2.yaml").read_text(encoding="utf-8")
    plan = json.loads((folder / "loop/plan2/plan.json").read_text(encoding="utf-8"))
    assert plan["requirements"][0]["achieved"] <= plan["requirements"][0]["limit"]
    assert "gyro.g_sensitivity" in plan["allowances"]


def test_a_clean_unit_is_clean_with_exit_code_0_and_nothing_to_update(run: Run, tmp_path: Path) -> None:
    assert run("simulate", SPEC, "--seed", "5", "-o", "data.csv").code == 0
    found = run("diagnose", "data.csv", "--spec", SPEC, "-o", "d", "--json")
    assert found.code == 0
    assert found.json["verdict"] == "clean"
    assert found.json["effects"] == []
    assert found.json["navigation"]["before"] == 0.0
    assert (tmp_path / "d/report.html").exists()


def test_several_units_have_a_folder_each(run: Run, tmp_path: Path) -> None:
    assert run("simulate", SPEC, "--seed", "5", "-o", "one.csv").code == 0
    header, *rows = (tmp_path / "one.csv").read_text(encoding="utf-8").splitlines()
    column = header.split(",").index("unit")
    for number, row in enumerate(rows):
        cells = row.split(",")
        cells[column] = "a/b" if number % 2 else "second"
        rows[number] = ",".join(cells)
    rows.sort(key=lambda row: row.split(",")[column])
    (tmp_path / "two.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    found = run("diagnose", "two.csv", "--spec", SPEC, "-o", "d", "--json")
    assert found.code == 0, found.err
    assert [u["unit"] for u in found.json["units"]] == ["a/b", "second"]
    assert (tmp_path / "d/a_b/diagnosis.json").exists()
    assert (tmp_path / "d/second/report.html").exists()


# ---------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "empty"),
        ("unit,run\n", "no rows"),
        ("a,b\n1,2\n", "column"),
        ("unit,run,time_on_s,temp_degc\nu,1,10,20\n", "readings"),
    ],
)
def test_a_table_that_is_none_is_refused(content: str, said: str, run: Run, tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text(content, encoding="utf-8")
    found = run("diagnose", "data.csv", "--spec", SPEC, "-o", "d")
    assert found.code == 2
    assert "Traceback" not in found.err
    assert not (tmp_path / "d").exists()


def test_files_that_are_not_there_are_named(run: Run) -> None:
    assert run("diagnose", "nowhere.csv", "--spec", SPEC).code == 2
    missing = run("update", SPEC, "--diagnosis", "nowhere.json", "-o", "new.yaml")
    assert missing.code == 2
    assert "nowhere.json" in missing.err


def test_an_update_does_not_overwrite_its_own_spec(run: Run, tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_bytes(SPEC.read_bytes())
    (tmp_path / "d.json").write_text("{}", encoding="utf-8")
    found = run("update", mine, "--diagnosis", "d.json", "-o", mine)
    assert found.code == 2
    assert "old spec" in found.err
    assert yaml.safe_load(mine.read_text(encoding="utf-8"))["planner"] == 1
