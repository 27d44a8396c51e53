"""`planner --help` against `python -c "import typer"`: starting costs hardly more than the library itself.

First the answer: the help names every command. Then the two are started in turn, so that both see the same
machine; the ratio of their medians is judged.

    python benchmarks/bench_help.py
"""

from __future__ import annotations

import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path

STARTS = 15
LARGEST_RATIO = 3.0
COMMANDS = ("init", "check", "schema", "plan", "sensitivity", "allow", "compare")


def console_script() -> list[str]:
    """The installed `planner` of this Python."""
    beside = Path(sys.executable).with_name("planner")
    found = str(beside) if beside.exists() else shutil.which("planner")
    assert found, "planner is not installed"
    return [found]


def seconds(command: list[str]) -> float:
    begin = time.perf_counter()
    subprocess.run(command, capture_output=True, check=True)
    return time.perf_counter() - begin


def main() -> None:
    ours, typer = [*console_script(), "--help"], [sys.executable, "-c", "import typer"]
    text = subprocess.run(ours, capture_output=True, text=True, check=True).stdout
    assert all(f"  {name} " in text for name in COMMANDS), "the help lacks a command"
    pairs = [(seconds(ours), seconds(typer)) for _ in range(STARTS)]
    help_s, typer_s = (statistics.median(column) for column in zip(*pairs, strict=True))
    ratio = help_s / typer_s
    print(
        f"planner --help {help_s * 1e3:.0f} ms, import typer {typer_s * 1e3:.0f} ms: ratio {ratio:.2f}",
        end="",
    )
    print(f" (medians of {STARTS})")
    assert ratio <= LARGEST_RATIO, f"ratio {ratio:.2f} > {LARGEST_RATIO}"


if __name__ == "__main__":
    main()
