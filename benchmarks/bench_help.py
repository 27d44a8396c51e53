"""Starting: `planner --help` against `python -c "import typer"`, and `planner check` of a shipped spec.

First the answer: the help names every command, the spec has no faults. Then all are started in turn, so that
they see the same machine; medians of processor time are judged. Run it where only planner is installed, and
without PYTHONDONTWRITEBYTECODE.

    python benchmarks/bench_help.py
"""

from __future__ import annotations

import resource
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

STARTS = 15
LARGEST_RATIO = 1.2
LARGEST_CHECK_S = 0.5
SPEC = Path(__file__).parents[1] / "requirements_specs" / "small_uav.yaml"
COMMANDS = ("init", "check", "schema", "plan", "sensitivity", "allow", "compare")


def console_script() -> list[str]:
    """The installed `planner` of this Python."""
    beside = Path(sys.executable).with_name("planner")
    found = str(beside) if beside.exists() else shutil.which("planner")
    assert found, "planner is not installed"
    return [found]


def seconds(command: list[str]) -> float:
    """Processor time of a command, its own and its children's."""
    begin = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, capture_output=True, check=True)
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    return end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime


def main() -> None:
    ours, typer = [*console_script(), "--help"], [sys.executable, "-c", "import typer"]
    check = [*console_script(), "check", str(SPEC)]
    text = subprocess.run(ours, capture_output=True, text=True, check=True).stdout
    assert all(f"  {name} " in text for name in COMMANDS), "the help lacks a command"
    assert "no faults" in subprocess.run(check, capture_output=True, text=True, check=True).stdout
    rounds = [(seconds(ours), seconds(typer), seconds(check)) for _ in range(STARTS)]
    help_s, typer_s, check_s = (statistics.median(column) for column in zip(*rounds, strict=True))
    ratio = help_s / typer_s
    print(
        f"planner --help {help_s * 1e3:.0f} ms, import typer {typer_s * 1e3:.0f} ms: ratio {ratio:.2f}",
        end="",
    )
    print(f"; planner check {SPEC.name} {check_s:.2f} s (medians of {STARTS}, processor time)")
    assert ratio <= LARGEST_RATIO, f"ratio {ratio:.2f} > {LARGEST_RATIO}"
    assert check_s <= LARGEST_CHECK_S, f"{check_s:.2f} s > {LARGEST_CHECK_S}"


if __name__ == "__main__":
    main()
