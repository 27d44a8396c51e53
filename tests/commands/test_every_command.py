"""Every command from outside: help, usage, JSON; init, check, schema."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import planner
from planner.cli import app
from tests.commands.specs import written
from tests.outcome import Run
from tests.specs import small

COMMANDS = sorted(command.callback.__name__ for command in app.registered_commands if command.callback)
NAMED_IN_THE_INTERFACES = ("init", "check", "schema", "plan", "sensitivity", "allow", "compare")


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
