"""What all commands share: standard input and output, --force, --quiet, --verbose, Ctrl-C, completion."""

from __future__ import annotations

import contextlib
import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

import planner
from planner.commands import sign
from planner.commands.output import ProgressLine, timed, until_ctrl_c
from planner.verify.workers import locally
from tests.outcome import Run
from tests.specs import ROOT, small


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "spec.yaml"
    path.write_text(yaml.safe_dump(small(), sort_keys=False))
    return path


def test_a_spec_comes_from_standard_input_and_a_plan_goes_to_standard_output(run: Run, spec, monkeypatch):
    class Given:
        buffer = io.BytesIO(spec.read_bytes())

    monkeypatch.setattr(sys, "stdin", Given)
    found = run("plan", "-", "-o", "-")
    assert found.code == 0
    assert json.loads(found.out)["spec"]["name"] == "small"
    Given.buffer = io.BytesIO(found.out.encode())
    listed = run("export", "-", "--format", "csv", "-o", "-")
    assert listed.code == 0
    assert "start_s" in listed.out
    assert run("init", "-").out.startswith("# A spec")
    assert [path.name for path in spec.parent.iterdir()] == ["spec.yaml"]


def test_what_is_there_is_replaced_by_force_only(run: Run, spec: Path) -> None:
    refused = run("init", spec)
    assert (refused.code, "--force" in refused.err) == (2, True)
    assert run("init", spec, "--force").code == 0
    assert spec.read_text().startswith("# A spec")


def test_quiet_says_the_result_alone_and_verbose_every_stage(run: Run, spec: Path) -> None:
    assert run("plan", spec, "--quiet").err == ""
    told = run("plan", spec, "--verbose").err
    assert "choosing temperatures and repeats (0 s)" in told
    assert "the shortest so far: " in told
    assert " h, gap " in told
    assert "genetic algorithm: generation 1 of at most " in told
    assert timed("3 of 10 points", 20.0, 6.0) == "3 of 10 points (20 s, about 14 s left)"
    assert timed("0 of 10 points", 6.0, 0.0) == "0 of 10 points (6 s)"


def test_the_progress_line_runs_on_and_counts_the_time_that_is_left_by_stages(
    capsys: pytest.CaptureFixture[str],
) -> None:
    clock = [0.0]
    line = ProgressLine(lambda: clock[0])
    said = ((0.0, "reading"), (9.0, "flight 0 of 4"), (10.0, "flight 1 of 4"), (10.5, "flight 2 of 4"))
    for moment, message in said:
        clock[0] = moment
        line.print(message)
    clock[0] = 11.0
    assert str(line) == "flight 2 of 4 (11 s, about 2 s left)"
    assert capsys.readouterr().err.splitlines() == [
        "reading (0 s)",
        "flight 0 of 4 (9 s)",
        "flight 1 of 4 (10 s, about 3 s left)",
    ]


class Terminal(io.StringIO):
    """What stands on a terminal's last line after all that was written."""

    def isatty(self) -> bool:
        return True

    def seen(self) -> list[str]:
        return [line.rpartition("\r")[2] for line in self.getvalue().split("\n")]


def within_a_second(happened: Callable[[], bool]) -> bool:
    until = time.monotonic() + 5.0
    while not happened() and time.monotonic() < until:
        time.sleep(0.01)
    return happened()


def test_the_sign_of_a_start_gives_way_to_the_first_word(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stdout", terminal)
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(sign, "AFTER_S", 0.0)
    sign.starting(["plan"])
    try:
        assert within_a_second(lambda: "working (" in terminal.getvalue())
        print("the answer")
    finally:
        sign.ended()
    assert sys.stdout is sys.stderr is terminal
    assert terminal.seen() == ["the answer", ""]


def test_a_stage_is_shown_again_below_what_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stdout", terminal)
    monkeypatch.setattr(sys, "stderr", terminal)
    with sign.showing(lambda: "flying"):
        assert within_a_second(lambda: "flying" in terminal.getvalue())
        print("half a line", end="")
        print(", the rest")
        assert terminal.seen()[0] == "half a line, the rest"
        assert within_a_second(lambda: "flying" in terminal.seen()[-1])
    sign.ended()
    assert terminal.seen() == ["half a line, the rest", ""]
    assert sys.stdout is sys.stderr is terminal


@pytest.mark.parametrize("words", [["check", "--quiet"], ["check", "--verbose"]], ids=" ".join)
def test_nobody_is_shown_lines_that_come_and_go_who_does_not_want_them(
    words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    assert sign.wanted(["check"])
    assert not sign.wanted(words)
    monkeypatch.setenv("NO_COLOR", "1")
    assert not sign.wanted(["check"])


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_program_on_a_terminal_leaves_its_result_there_alone(spec: Path) -> None:
    import pty

    child, terminal = pty.fork()
    if child == 0:
        os.environ.pop("NO_COLOR", None)
        os.execve(
            sys.executable,
            [sys.executable, "-m", "planner", "check", str(spec)],
            {**os.environ, "TERM": "xterm", "PYTHONPATH": str(ROOT)},
        )
    said = b""
    with contextlib.suppress(OSError):  # the other end is closed
        while more := os.read(terminal, 4096):
            said += more
    os.close(terminal)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    lines = [line.rpartition("\r")[2] for line in said.decode().replace("\r\n", "\n").split("\n")]
    assert "".join(lines).endswith(f"{spec}: no faults")


def test_a_plan_by_hand_that_misses_its_limit_is_a_no(run: Run, spec: Path) -> None:
    tree = small()
    few = {"temperatures": 1, "repeats": 2}
    tree["plan"] = {**tree["plan"], "fixed": dict.fromkeys(tree["tests"], few)}
    spec.write_text(yaml.safe_dump(tree, sort_keys=False))
    found = run("plan", spec)
    assert found.code == 1, found.err
    assert "misses its requirement: position" in found.err


def test_a_plan_that_is_stopped_keeps_the_best_so_far(spec: Path) -> None:
    made = planner.plan(spec, stop=lambda: True)
    assert any("stopped; cut short" in note for note in made.notes)
    assert all(one.met for one in made.requirements)


def test_ctrl_c_asks_for_the_best_so_far_and_twice_ends() -> None:
    was = signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background begins without
    try:
        with until_ctrl_c() as stop:
            assert not stop()
            os.kill(os.getpid(), signal.SIGINT)
            assert stop()
            with pytest.raises(KeyboardInterrupt):
                os.kill(os.getpid(), signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, was)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_names_every_command_and_its_options(run: Run, shell: str) -> None:
    told = run("--show-completion", shell).out
    assert "verify" in told
    assert "through-files" in told
    assert run("--show-completion", "tcsh").code == 2


def test_bash_completes() -> None:
    asked = (
        'eval "$(python -m planner --show-completion bash)"; COMP_WORDS=(planner plan --o); COMP_CWORD=2; '
        '_planner; echo "${COMPREPLY[@]}"'
    ).replace("python", sys.executable)
    told = subprocess.run(["bash", "-c", asked], capture_output=True, text=True, cwd=ROOT, check=True)
    assert told.stdout.strip() == "--out"


def slow(folder: str, number: int, size: int) -> int:
    Path(folder, f"{os.getpid()}.pid").touch()
    time.sleep(60)
    return number


def test_a_killed_run_leaves_no_worker_behind(tmp_path: Path) -> None:
    work = f"list(locally(2, slow, {str(tmp_path)!r}, [(0, 1), (1, 1)]))"
    code = f"from tests.test_options import slow, locally; {work}"
    here = {**os.environ, "PYTHONPATH": str(ROOT)}
    parent = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, env=here)
    workers = waited(lambda: [int(p.stem) for p in tmp_path.glob("*.pid")], lambda found: len(found) == 2)
    os.kill(parent.pid, signal.SIGKILL)
    parent.wait()
    assert waited(lambda: [pid for pid in workers if alive(pid)], lambda left: not left) == []


def waited(look, enough, seconds: float = 60.0):
    end = time.monotonic() + seconds
    while not enough(found := look()) and time.monotonic() < end:
        time.sleep(0.1)
    return found


def alive(pid: int) -> bool:
    """Running; one that has ended and was not collected does not count."""
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False


assert locally  # for the process of the test above
