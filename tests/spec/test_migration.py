"""A spec of an older planner comes to the present format and says what it said; its comments stay."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

import planner
from planner.errors import InputError
from planner.spec.load import spec_from_bytes
from planner.spec.migration import migrated
from planner.spec.starter import starter_text
from planner.spec.text_edit import SpecText
from tests.outcome import Run

FILE = Path("spec.yaml")
OLD = starter_text().replace("planner: 1\n", "", 1)
PUBLISHED_KEYS = ("confidence: 95 %", "confidence: 95 %\n  quantile: normal   # as published")


def loaded(text: str) -> object:
    return spec_from_bytes(text.encode(), FILE).spec


@pytest.mark.parametrize("first", ["", "planner: 0\n", "planner: '1'\n", "planner: v1\n"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_an_old_format_is_said_and_nothing_else_changes(first: str, newline: str) -> None:
    old = (first + OLD).replace("\n", newline)
    found = migrated(old.encode(), FILE)
    assert len(found.changes) == 1
    assert found.spec.spec == loaded(starter_text())
    assert sorted(found.spec.text.splitlines()) == sorted(["planner: 1", *OLD.splitlines()])
    again = migrated(found.spec.data, FILE)
    assert (again.changes, again.diff, again.spec.data) == ((), "", found.spec.data)


def old_plan(flow: bool) -> str:
    """The starter with keys that only the published method reads, in the two styles of YAML."""
    tree = yaml.safe_load(OLD)
    tree["plan"]["quantile"] = "normal"
    tree["plan"]["temperatures"] |= {"candidates": [3, 5], "interpolate": True}
    return "# mine\n" + yaml.safe_dump(tree, sort_keys=False, default_flow_style=flow)


@pytest.mark.parametrize("flow", [False, True], ids=["block", "flow"])
def test_keys_that_nobody_reads_go_and_the_plan_stays(flow: bool) -> None:
    found = migrated(old_plan(flow).encode(), FILE)
    assert len(found.changes) == 4
    assert found.spec.spec == loaded(starter_text())
    assert not [warning for warning in found.spec.warnings if warning.code == "P531"]
    assert found.spec.text.startswith("# mine\n")


@pytest.mark.parametrize("flow", [False, True], ids=["block", "flow"])
def test_the_method_of_then_keeps_its_keys(flow: bool) -> None:
    found = planner.migrate(yaml.safe_load(old_plan(flow)), published=True)
    plan = found.spec.spec.plan
    assert (plan.method, plan.quantile, plan.temperatures.candidates) == ("published", "normal", (3, 5))


def test_a_mapping_goes_with_its_last_entry() -> None:
    edit = SpecText("a: 1\nb:\n  c:\n    d: 2  # two\ne: {f: {g: 3}, h: 4}\n")
    edit.remove(("b", "c", "d"))
    edit.remove(("e", "f", "g"))
    assert edit.edited() == "a: 1\ne: {h: 4}\n"


def test_what_no_migration_mends_is_refused_at_its_place_in_the_old_text() -> None:
    with pytest.raises(InputError, match="planner: 2; this planner reads format 1"):
        migrated(b"planner: 2\n" + OLD.encode(), FILE)
    broken = OLD.replace("confidence: 95 %", "confidence: 950 %").replace("record: ", "recrod: ", 1)
    with pytest.raises(InputError) as refusal:
        migrated(broken.encode(), FILE)
    lines = broken.splitlines()
    assert len(refusal.value.faults) >= 2
    assert any("950 %" in lines[fault.line - 1] for fault in refusal.value.faults)


def test_the_command_shows_first_and_writes_when_told(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "old.yaml"
    file.write_text(OLD)
    shown = run("migrate", file)
    assert (shown.code, file.read_text()) == (0, OLD)
    assert "+planner: 1" in shown.out
    assert "--force" in shown.out
    assert run("migrate", file, "-o", tmp_path / "new.yaml").code == 0
    assert run("check", tmp_path / "new.yaml").code == 0
    assert run("migrate", file, "-o", tmp_path / "new.yaml").code == 2  # it is there already
    assert run("migrate", file, "-o", "-").out == (tmp_path / "new.yaml").read_text()
    found = run("migrate", file, "--force", "--json")
    assert found.json["written"] == str(file)
    assert file.read_text() == (tmp_path / "new.yaml").read_text()
    assert "nothing is to be changed" in run("migrate", file).out
