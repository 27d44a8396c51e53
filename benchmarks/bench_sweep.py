"""A sweep: seconds a planned point, and how much two workers save.

Run as `python benchmarks/bench_sweep.py [POINTS A SIDE]`. Asserted before any time: one and two workers leave
the same table, document and page to the last byte; so does a sweep that was killed with its workers in the
middle and went on; and a point's hours are those that `planner plan` finds, genetic algorithm and all.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

from planner.spec.yaml12 import read_yaml

SPEC = Path(__file__).parents[1] / "requirements_specs/small_uav.yaml"
FILES = ("sweep.csv", "sweep.json", "report.html")
LIMITS, CONFIDENCES = "requirement.0.limit=300..600m", "plan.confidence=80..99%"
COMMAND = (sys.executable, "-m", "planner")


def command(folder: Path, side: int, workers: int) -> list[str]:
    grid = ["--vary", LIMITS, "--vary", CONFIDENCES, "--points", str(side)]
    return [*COMMAND, "sweep", str(SPEC), *grid, "--workers", str(workers), "-o", str(folder)]


def swept(folder: Path, side: int, workers: int) -> float:
    """Seconds of the whole command."""
    start = time.perf_counter()
    subprocess.run(command(folder, side, workers), check=True, capture_output=True)
    return time.perf_counter() - start


def killed(folder: Path, side: int) -> int:
    """How many points were kept of a sweep whose processes were all killed when a third was done."""
    process = subprocess.Popen(
        command(folder, side, 2), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        while process.poll() is None and len(list(folder.glob("points/*.json"))) < side * side // 3:
            time.sleep(0.02)
        assert process.poll() is None, "the sweep was over before it could be killed; give more points"
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    assert not (folder / "sweep.json").exists()
    return len(list(folder.glob("points/*.json")))


def same(one: Path, other: Path) -> None:
    for name in FILES:
        assert (one / name).read_bytes() == (other / name).read_bytes(), f"{name} differs"


def same_as_plan(folder: Path, scratch: Path) -> None:
    """Every point has a campaign; that of the first is what `planner plan` finds."""
    points: list[dict[str, Any]] = json.loads((folder / "sweep.json").read_text())["points"]
    assert all(p["status"] == "planned" for p in points)
    point, tree = points[0], dict(read_yaml(SPEC.read_bytes(), str(SPEC)).value)
    tree["requirement"][0]["limit"] = point["values"]["requirement.0.limit"]
    tree["plan"]["confidence"] = point["values"]["plan.confidence"]
    (scratch / "one.yaml").write_text(yaml.safe_dump(tree, sort_keys=False))
    done = subprocess.run(
        [*COMMAND, "plan", "one.yaml", "--json"], cwd=scratch, check=True, capture_output=True, text=True
    )
    assert json.loads(done.stdout)["time_s"] == point["time_s"]


def main(side: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        swept(scratch / "warm", 2, 2)
        begun = swept(scratch / "begun", 1, 1)  # imports, and one point
        one, two = swept(scratch / "one", side, 1), swept(scratch / "two", side, 2)
        same(scratch / "one", scratch / "two")
        kept = killed(scratch / "again", side)
        resumed = swept(scratch / "again", side, 2)
        same(scratch / "one", scratch / "again")
        same_as_plan(scratch / "one", scratch)
    count = side * side
    each = (one - begun) / (count - 1)
    print(f"{count} points of {SPEC.stem}; the same bytes from 1 and 2 workers, and after a kill at {kept}")
    print(f"  1 worker   {one:7.2f} s   {each:.3f} s a point, after {begun:.2f} s for the first")
    print(f"  2 workers  {two:7.2f} s   {one / two:.2f} times as fast; efficiency {one / two / 2:.0%}")
    print(f"  resumed    {resumed:7.2f} s   for the {count - kept} points that were left")
    print(f"  {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}: what others take is missing above")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 6)
