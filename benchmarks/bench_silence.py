"""How long every command says nothing on a terminal: from its start, between two signs of life, to its end.

Each runs on a pseudo-terminal of its own, in the order in which a user's files come about; what it writes is
timed as it comes. First the answer: every command has one. Then no silence may be longer than
LONGEST_S on an idle machine; `--most` says what is allowed on one that is not.

    python benchmarks/bench_silence.py [--most SECONDS]
"""

from __future__ import annotations

import argparse
import os
import pty
import select
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from datetime import date, timedelta
from pathlib import Path

ROOT = Path(__file__).parents[1]
LONGEST_S = 1.0
SPEC = ROOT / "requirements_specs" / "small_uav.yaml"
ANSWERS = (0, 1, 4)  # done, no, not sure yet
LINES = (
    "init own.yaml",
    "check {spec}",
    "schema",
    "plan {spec} -o plan",
    "plan {shipped}/small_uav_worst_case.yaml -o published",
    "sensitivity {spec}",
    "allow {spec}",
    "compare plan published",
    "why plan",
    "afford {spec} --hours 8",
    "export plan --format csv -o bench",
    "verify {spec} plan --flights 400",
    "simulate {loop} --hidden g_sensitivity=0.02deg/s/g --seed 5 -o data.csv",
    "calibrate data.csv --spec {loop} -o cal",
    "diagnose data.csv --spec {loop} -o diagnosis",
    "update {loop} --diagnosis diagnosis/diagnosis.json -o spec2.yaml",
    "look raw.csv -o look",
    "reduce raw.csv --columns look/map.yaml -o dwells.csv",
    "apply cal data.csv -o applied.csv",
    "sweep {spec} --vary requirement.0.limit=150,200,300m -o sweep",
    "accept data.csv --spec {loop} -o accepted",
    "forecast history.csv --spec {spec} --until 365 -o forecast",
    "recalibrate {shipped}/recalibration.yaml --start 2026-12-01 -o store",
    "effects",
    "explain P111",
    "docs tutorial",
    "migrate {spec}",
    "reproduce plan --spec {spec}",
)


@dataclass(frozen=True)
class Heard:
    """A command on a terminal. first_s: until it said anything; silence_s: longest; after: which words."""

    line: str
    code: int
    seconds: float
    first_s: float
    silence_s: float
    after: str


def heard(line: str, folder: Path) -> Heard:
    """Run a command on a pseudo-terminal and time what it says."""
    child, terminal = pty.fork()
    if child == 0:
        os.chdir(folder)
        os.environ.update({"TERM": "xterm", "COLUMNS": "120", "PYTHONPATH": str(ROOT)})
        os.environ.pop("NO_COLOR", None)
        os.execv(sys.executable, [sys.executable, "-m", "planner", *line.split()])
    began = last = time.monotonic()
    first, silence, after, words = None, 0.0, "nothing", "nothing"
    while True:
        ready, _, _ = select.select([terminal], [], [], 600)
        try:
            said = os.read(terminal, 65536) if ready else b""
        except OSError:  # the other end is closed
            said = b""
        now = time.monotonic()
        first = now - began if first is None else first
        if now - last > silence:
            silence, after = now - last, words
        last = now
        if not said:
            break
        words = (
            " ".join("".join(c for c in said.decode(errors="replace") if c.isprintable()).split())[-60:]
            or words
        )
    _, status = os.waitpid(child, 0)
    os.close(terminal)
    return Heard(line, os.waitstatus_to_exitcode(status), last - began, first or 0.0, silence, after)


def history(path: Path) -> None:
    """A short history in store, for forecast."""
    days = [(week, date(2026, 1, 5) + timedelta(days=7 * week)) for week in range(16)]
    rows = [
        f"{u},{day},accelerometer.bias,x,{0.0001 * w:.6f} g,0.0002 g" for u in ("a", "b") for w, day in days
    ]
    path.write_text("\n".join(["unit,date,error,term,value,uncertainty", *rows]) + "\n", encoding="utf-8")


def recording(folder: Path) -> None:
    """raw.csv, as the page on recordings makes it."""
    page = (ROOT / "planner" / "docs" / "how_to" / "recordings.md").read_text(encoding="utf-8")
    script = page.partition("```python\n")[2].partition("```")[0]
    subprocess.run([sys.executable, "-c", script], cwd=folder, check=True)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--most", type=float, default=LONGEST_S)
    parser.add_argument("--only", default="", help="text that a command line must hold")
    asked = parser.parse_args()
    places = {
        "spec": SPEC,
        "shipped": SPEC.parent,
        "loop": SPEC.with_name("close_the_loop.yaml"),
    }
    found = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        history(folder / "history.csv")
        recording(folder)
        for template in LINES:
            one = heard(template.format(**places), folder)
            shown = template.replace("{spec}", "SPEC").replace("{loop}", "SPEC").replace("{shipped}/", "")
            print(
                f"{one.silence_s:5.2f} s silent of {one.seconds:6.2f}, first sign {one.first_s:5.2f} s  "
                f"{shown}   (after: {one.after})",
                flush=True,
            )
            assert one.code in ANSWERS, f"{one.line}: exit {one.code}"
            found.append(one)
    worst = max(found, key=lambda one: one.silence_s)
    print(f"longest silence {worst.silence_s:.2f} s: {worst.line}")
    assert worst.silence_s <= asked.most, f"{worst.silence_s:.2f} s > {asked.most} s"


if __name__ == "__main__":
    main()
