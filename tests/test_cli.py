"""The commands from outside: what stands on stdout and stderr, exit codes, files, refusals.

Most tests call the program's `main` in this process, which is what the console script does; a few start a
process of their own, where the terminal, the environment or a broken pipe matter.
"""

from __future__ import annotations

import csv
import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml

import planner
from planner.cli import app
from planner.own_files import LIST
from planner.pipelines import planning as pipeline
from tests.documents import keeps
from tests.outcome import Run
from tests.specs import planned, shipped, small, with_limit, with_plan

COMMANDS = sorted(command.callback.__name__ for command in app.registered_commands if command.callback)
NAMED_IN_THE_INTERFACES = ("init", "check", "schema", "plan", "sensitivity", "allow", "compare")
FILES = {"plan.json", "steps.csv", "report.html"}


def written(path: Path, spec: dict[str, Any]) -> Path:
    path.write_text(yaml.safe_dump(spec, sort_keys=False), encoding="utf-8")
    return path


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    return written(tmp_path / "campaign.yaml", small())


def flown() -> dict[str, Any]:
    """The small spec on a simulated flight."""
    flight = {"trajectory": {"name": "level", "duration": "20 s"}, "sensitivities": "simulated"}
    return with_limit(small(), "500 m") | flight


# ---------------------------------------------------------------- every command


def test_the_commands_of_the_interfaces_are_there() -> None:
    assert set(NAMED_IN_THE_INTERFACES) <= set(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_an_example_that_calls_the_command(command: str, run: Run) -> None:
    found = run(command.replace("_", "-"), "--help")
    assert found.code == 0
    assert "Example: planner " + command.replace("_", "-") in " ".join(found.out.split())
    assert not found.err


def test_the_list_of_commands_that_is_shown_at_once_is_typers(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    file = Path(planner.__file__).parent / "commands" / "help.txt"
    again = "sys.argv = ['planner', '--help']; from planner.cli import main; main()"
    shown = run("--help").out.replace(Path(sys.argv[0]).name, "planner", 1)
    said = f'COLUMNS=80 python -c "import sys; {again}" > {file}'
    assert file.read_text(encoding="utf-8").split("\n")[1:] == shown.split("\n")[1:], said
    code = (
        "import sys; sys.argv = ['planner', '--help']; from planner.__main__ import main; main();"
        "sys.exit('typer' in sys.modules)"
    )
    quick = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert quick.stdout == file.read_text(encoding="utf-8")


def test_every_command_of_the_interfaces_has_json(run: Run) -> None:
    assert all("--json" in run(command, "--help").out for command in NAMED_IN_THE_INTERFACES)


def test_the_version_is_the_packages(run: Run) -> None:
    from planner import __version__

    assert run("--version").out.strip() == __version__


@pytest.mark.parametrize("arguments", [["plan"], ["nosuch"], ["plan", "x.yaml", "--nosuch"], ["compare"], []])
def test_wrong_usage_is_exit_2_with_nothing_on_stdout_but_help(arguments: list[str], run: Run) -> None:
    found = run(*arguments)
    assert found.code == 2
    assert "Usage: planner" in found.out + found.err
    assert "Traceback" not in found.err


# ---------------------------------------------------------------- init, check, schema


def test_the_starter_spec_is_written_once_and_has_no_faults(run: Run, tmp_path: Path) -> None:
    first = run("init")
    assert (first.code, first.err) == (0, "")
    assert "spec.yaml" in first.out
    assert run("check", "spec.yaml").code == 0
    before = (tmp_path / "spec.yaml").read_bytes()
    again = run("init", "spec.yaml")
    assert (again.code, again.out) == (2, "")
    assert "exists already" in again.err
    assert (tmp_path / "spec.yaml").read_bytes() == before


def test_init_in_json(run: Run) -> None:
    assert run("init", "new.yaml", "--json").json == {"written": "new.yaml"}


def test_check_names_every_fault_with_its_place(run: Run, tmp_path: Path) -> None:
    broken = small() | {"effects": ["bais"]}
    broken["requirement"] = [{"error": "position", "limit": "10 kg", "rule": "worst_case"}]
    found = run("check", written(tmp_path / "broken.yaml", broken))
    assert (found.code, found.out) == (2, "")
    places = [line for line in found.err.splitlines() if "broken.yaml:" in line]
    assert len(places) >= 2
    assert any("requirement[0].limit" in line for line in places)
    assert any("did you mean 'bias'?" in line for line in places)


def test_check_in_json_gives_faults_by_line_and_column(run: Run, tmp_path: Path) -> None:
    found = run("check", "--json", written(tmp_path / "broken.yaml", small() | {"efects": []}))
    told = found.envelope
    assert (told["command"], told["ok"], told["exit_code"], told["result"]) == ("check", False, 2, None)
    assert found.code == 2
    assert {"code", "path", "line", "column", "message", "remedy"} <= set(told["faults"][0])
    assert told["faults"][0]["line"] > 0


def test_check_warns_on_stderr_and_still_says_yes(run: Run, tmp_path: Path) -> None:
    odd = small() | {"effects": ["bias", "bias_temperature", "warm_up"]}
    found = run("check", written(tmp_path / "odd.yaml", odd))
    assert found.code == 0
    assert "warning: " in found.err
    assert "warm_up" in found.err
    assert "no faults" in found.out


def test_the_schema_accepts_what_check_accepts(run: Run) -> None:
    import jsonschema

    jsonschema.validate(small(), run("schema").json)


# ---------------------------------------------------------------- plan


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

    from planner.pipelines import planning as pipeline

    made = pipeline.campaign
    monkeypatch.setattr(
        pipeline, "campaign", lambda *asked: replace(made(*asked), bound=1.0, proved=False)
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


def test_a_folder_that_cannot_be_written_is_exit_2(run: Run, spec: Path, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file, no folder")
    found = run("plan", spec, "-o", "taken")
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


# ---------------------------------------------------------------- the program as a process


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
