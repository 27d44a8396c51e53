"""`planner plan` from outside: files, exit codes, refusals."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from planner.own_files import LIST
from planner.pipelines import published
from tests.commands.specs import written
from tests.outcome import Run
from tests.specs import small, with_limit, with_plan

FILES = {"plan.json", "steps.csv", "report.html"}


def test_plan_writes_three_files_and_prints_the_answer_first(run: Run, spec: Path, tmp_path: Path) -> None:
    found = run("plan", spec)
    assert found.code == 0
    folder = tmp_path / "plans" / "campaign"
    assert {file.name for file in folder.iterdir()} == {*FILES, LIST}
    assert found.out.splitlines()[0] == "small"
    assert "Proved" in found.out.splitlines()[1]
    assert "10 m" in found.out
    assert found.err == ""
    assert "\x1b" not in found.out  # no colour when nobody watches


def test_plan_in_json_is_the_document_that_is_written(run: Run, spec: Path, tmp_path: Path) -> None:
    found = run("plan", spec, "-o", "out", "--json")
    assert found.json == json.loads((tmp_path / "out" / "plan.json").read_text(encoding="utf-8"))
    assert found.json["gap"] == 0
    assert found.json["requirements"][0]["met"] is True


def test_the_same_spec_gives_the_same_bytes(run: Run, spec: Path, tmp_path: Path) -> None:
    run("plan", spec, "-o", "one")
    run("plan", spec, "-o", "two")
    for name in FILES:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name


def test_a_plan_is_replaced_whole(run: Run, spec: Path, tmp_path: Path) -> None:
    run("plan", spec, "-o", "out")
    written(spec, with_limit(small(), "11 m"))
    assert run("plan", spec, "-o", "out").code == 0
    assert {file.name for file in (tmp_path / "out").iterdir()} == {*FILES, LIST}
    assert json.loads((tmp_path / "out" / "plan.json").read_text())["requirements"][0]["limit"] == 11


def test_what_cannot_be_met_is_exit_3_and_names_a_limit_that_can(
    run: Run, spec: Path, tmp_path: Path
) -> None:
    written(spec, with_limit(small(), "1 m"))
    found = run("plan", spec, "-o", "out")
    assert (found.code, found.out) == (3, "")
    assert "gyro.bias" in found.err
    assert not (tmp_path / "out").exists()
    nearest = found.err.partition("nearest limit that can be met is ")[2].strip()
    written(spec, with_limit(small(), nearest))
    assert run("plan", spec, "-o", "out").code == 0


def test_exit_3_in_json(run: Run, spec: Path) -> None:
    written(spec, with_limit(small(), "1 m"))
    found = run("plan", spec, "--json")
    assert found.code == found.envelope["exit_code"] == 3
    (fault,) = found.envelope["faults"]
    assert fault["message"]
    assert found.json["nearest_limit"] > 1.0
    assert sum(part["share"] for part in found.json["binds"]) == pytest.approx(1.0)


def test_all_requirements_that_cannot_be_met_are_named(run: Run, spec: Path) -> None:
    limits = [{"error": "position", "limit": limit, "rule": "rss"} for limit in ("1 mm", "2 mm")]
    written(spec, small() | {"requirement": limits})
    found = run("plan", spec)
    assert found.code == 3
    assert "requirement 1 " in found.err
    assert "requirement 2 " in found.err


def test_a_hand_made_plan_is_timed_even_if_it_does_not_suffice(run: Run, spec: Path) -> None:
    fixed = {name: {"temperatures": 1, "repeats": 2} for name in small()["tests"]}
    written(spec, with_plan(small(), fixed=fixed))
    found = run("plan", spec)
    assert found.code == 1
    assert "NOT met" in found.out
    assert "Hand-made" in found.out


def test_stopped_before_the_proof_is_exit_4_with_the_files_kept(
    run: Run, spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    made = published.campaign
    monkeypatch.setattr(
        published, "campaign", lambda *asked: replace(made(*asked), bound=1.0, proved=False)
    )  # what the solver reports when plan.time_limit is over
    found = run("plan", spec, "-o", "out")
    assert found.code == 4
    assert "proof" in found.err
    assert "Not proved" in found.out
    document = json.loads((tmp_path / "out" / "plan.json").read_text(encoding="utf-8"))
    assert document["proved"] is False
    assert document["gap"] > 0


def test_a_campaign_that_outlives_the_sensors_is_remarked(run: Run, spec: Path) -> None:
    short = small()
    short["unit"] = short["unit"] | {"service_life": "10 min"}
    found = run("plan", written(spec, short))
    assert found.code == 0
    assert "unit.service_life" in found.err


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"- a\n- b\n",
        b"\x00\xff\xfe binary",
        b"a: &a [*a]\n",
        b"a: " + b"[" * 100_000,
        b"planner: " + b"9" * 5000,
    ],
    ids=["empty", "list", "binary", "alias in itself", "nested", "huge number"],
)
@pytest.mark.parametrize("command", ["check", "plan", "sensitivity", "allow"])
def test_no_spec_is_exit_2_and_nothing_is_written(
    command: str, content: bytes, run: Run, tmp_path: Path
) -> None:
    (tmp_path / "bad.yaml").write_bytes(content)
    found = run(command, "bad.yaml")
    assert (found.code, found.out) == (2, "")
    assert "bad.yaml:1:" in found.err
    assert {file.name for file in tmp_path.iterdir()} == {"bad.yaml"}


@pytest.mark.parametrize("folder", ["taken", "taken/deeper"])
def test_a_folder_that_cannot_be_written_is_exit_2(run: Run, spec: Path, tmp_path: Path, folder: str) -> None:
    """At once: an answer that is read before its files fail would have to be made again."""
    (tmp_path / "taken").write_text("a file, no folder")
    found = run("plan", spec, "-o", folder)
    assert (found.code, found.out) == (2, "")
    assert "cannot write" in found.err
    assert (tmp_path / "taken").read_text() == "a file, no folder"


@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_exit_2(run: Run, spec: Path, tmp_path: Path) -> None:
    (tmp_path / "locked").mkdir(mode=0o555)
    found = run("plan", spec, "-o", "locked")
    assert found.code == 2
    assert not list((tmp_path / "locked").iterdir())


def test_a_disk_that_fills_up_leaves_no_half_plan(
    run: Run, spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    count = []

    def full_at_the_second_file(descriptor: int) -> None:
        count.append(descriptor)
        if len(count) == 2:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full_at_the_second_file)
    found = run("plan", spec, "-o", "out")
    assert found.code == 2
    assert "No space left" in found.err
    assert not (tmp_path / "out").exists()
