"""The program as a process: streams, Ctrl-C, internal errors, what solvers print."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from planner.pipelines import planning as pipeline
from planner.pipelines import published
from tests.commands.specs import flown, written
from tests.outcome import Run
from tests.specs import planned, shipped, small


def flown_probably() -> dict[str, Any]:
    """The small spec on a simulated flight, planned by information."""
    requirement = {"error": "position", "limit": "500 m", "rule": {"percentile": "90 %"}}
    return flown() | {"requirement": [requirement]}


def process(*arguments: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "planner", *arguments],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_as_a_module_without_colour_or_animation(spec: Path, tmp_path: Path) -> None:
    found = process("plan", str(spec), folder=tmp_path, FORCE_COLOR="", NO_COLOR="1")
    assert found.returncode == 0
    assert "\x1b" not in found.stdout + found.stderr
    assert found.stdout.startswith("small\n")


def test_a_reader_that_goes_away_is_no_failure(tmp_path: Path) -> None:
    """`planner schema | head -1`: no traceback, no complaint."""
    command = [sys.executable, "-m", "planner", "schema"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout
        assert running.stderr
        running.stdout.close()
        err = running.stderr.read().decode()
        assert running.wait(timeout=60) == 0
    assert err == ""


def test_an_internal_error_is_exit_70_without_a_traceback(
    run: Run, spec: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from planner.pipelines import planning as pipeline

    def broken(*_: object) -> None:
        raise ZeroDivisionError("ours")

    monkeypatch.setattr(pipeline, "plan", broken)
    monkeypatch.delenv("PLANNER_DEBUG", raising=False)
    found = run("plan", spec)
    assert (found.code, found.out) == (70, "")
    assert found.err.startswith("internal error: ZeroDivisionError")
    assert "Traceback" not in found.err


def test_ctrl_c_is_exit_4(run: Run, spec: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(pipeline, "plan", interrupted)
    found = run("plan", spec, "-o", "out")
    assert (found.code, found.out) == (4, "")
    assert not (tmp_path / "out").exists()


def test_files_are_written_when_the_reader_of_the_answer_goes_away(spec: Path, tmp_path: Path) -> None:
    """`planner plan spec.yaml | head -1`: the answer is printed before the files are made."""
    command = [sys.executable, "-m", "planner", "plan", str(spec), "-o", "out"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout
        running.stdout.close()
        running.wait(timeout=120)
    assert {"plan.json", "steps.csv", "report.html"} <= {file.name for file in (tmp_path / "out").iterdir()}


@pytest.mark.parametrize(
    ("tree", "beside"),
    [(small, (published, "region_or_why_not")), (flown_probably, (pipeline, "genetic_beside"))],
)
def test_the_answer_is_there_before_anything_genetic(
    run: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    tree: Callable[[], dict[str, Any]],
    beside: tuple[Any, str],
) -> None:
    """By half-widths and by information: who stops the genetic part has read the plan, with its verdict."""
    spec = written(tmp_path / "campaign.yaml", tree())
    whole = run("plan", spec, "-o", "whole")

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(*beside, interrupted)
    found = run("plan", spec, "-o", "out")
    assert found.code == 4
    assert ": met" in found.out
    assert whole.out.replace("\nwrote whole/plan.json, steps.csv, report.html\n", "") == found.out
    assert not (tmp_path / "out").exists()


def test_ctrl_c_in_allow_keeps_the_region_so_far(
    run: Run, spec: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = run("allow", spec, "--json").json
    asked = iter(range(100_000))

    @contextmanager
    def pressed_after_two() -> Iterator[Callable[[], bool]]:
        yield lambda: next(asked) >= 2

    monkeypatch.setattr("planner.commands.planning.until_ctrl_c", pressed_after_two)
    found = run("allow", spec, "--json")
    assert (found.code, found.envelope["ok"]) == (4, False)
    assert "stopped after" in found.err
    early = found.json
    assert early["genetic"]["stopped"] == "time"
    assert 0 < early["genetic"]["generations"] < whole["genetic"]["generations"]
    assert early["corners"] == whole["corners"] or early["front"]


def test_a_plan_says_how_short_it_is_so_far_and_what_none_is_below() -> None:
    said: list[str] = []
    pipeline.plan(shipped("close_the_loop"), said.append)
    told = [re.search(r"so far: ([\d.]+) h, none below ([\d.]+) h, gap ([\d.]+) %", one) for one in said]
    gaps = [(float(m[1]), float(m[2]), float(m[3])) for m in told if m]
    assert gaps
    for best, bound, gap in gaps:
        assert bound <= best
        assert gap == pytest.approx(100 * (best - bound) / best, abs=0.3)  # both are shown to 0.01 h


def test_what_a_solver_prints_by_itself_stays_off_stdout(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """HiGHS prints lines from C on some problems, which would break `--json` for scripts."""
    import ctypes

    import scipy.optimize

    solve = scipy.optimize.milp

    def chatty(*arguments: Any, **options: Any) -> Any:
        ctypes.CDLL(None).puts(b"HighsMipSolverData::transformNewIntegerFeasibleSolution")
        return solve(*arguments, **options)

    monkeypatch.setattr(scipy.optimize, "milp", chatty)
    assert planned(small()).plan.proved
    ctypes.CDLL(None).fflush(None)
    assert capfd.readouterr().out == ""
