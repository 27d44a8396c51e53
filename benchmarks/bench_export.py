"""Export of a plan of 100 000 steps: every record at its time first, then how long each format takes.

python -m pytest benchmarks/bench_export.py
python benchmarks/bench_export.py --kills 1000    # kill -9 at random moments of exports: no torn file
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))  # the plans to export are the tests' own

from planner.catalog import exports
from planner.export.header import check_seal
from planner.export.outputs import collector_paused
from planner.protocols import Exported, ExportOptions
from tests.export import grammar
from tests.export.kills import exports_with_kills
from tests.export.samples import shipped, small

REPEATS = 20_000
FORMATS = [("acutrol", "host"), ("acutrol", "macro"), ("chamber", None), ("csv", None), ("json", None)]


@pytest.fixture(scope="module")
def plan() -> dict:
    """20 000 repeats of five steps, positions and rates in turns."""
    steps: list[tuple[str, float, dict]] = []
    for i in range(REPEATS):
        motion = {"rate_1_dps": 50.0 if i % 4 else -50.0} if i % 2 else {"position_1_deg": i % 360}
        steps += [
            ("power_on", 30.0, {}),
            ("move", 5.0, {"motion": motion}),
            ("record", 20.0, {"motion": motion}),
            ("power_off", 0.0, {}),
            ("cool_down", 60.0, {}),
        ]
    return small(steps)


@pytest.mark.parametrize(("form", "dialect"), FORMATS)
def test_exports_100_000_steps(benchmark, plan, form, dialect):
    def export() -> Exported:
        with collector_paused():
            check_seal(plan, "plan.json")
            return exports()[form].files(plan, ExportOptions(dialect or "host"))

    made = export()
    assert len(plan["steps"]) == 100_000
    if dialect == "host":
        lines = grammar.host(str(made.files["table.table.txt"]))
        assert sum(ms for _, ms in lines) == plan["steps"][-1]["end_s"] * 1000
        assert lines.count(("Pusk", 20_000)) == REPEATS
    if form == "csv":
        assert str(made.files["steps.csv"]).count("\n") == 100_001
    benchmark.pedantic(export, rounds=3)
    if benchmark.stats is not None:  # None under --benchmark-disable
        assert benchmark.stats.stats.min < 2.0


def two_versions(name: str) -> list[dict[str, bytes]]:
    """All formats of a shipped plan, and of the same plan with another hash."""
    versions = []
    for arm in (1.5, 1.6):
        document, files = shipped(name, centrifuge=arm), {}
        for form, dialect in [*FORMATS, ("ics", None)]:
            files |= exports()[form].files(document, ExportOptions(dialect)).files
        versions.append({n: c if isinstance(c, bytes) else c.encode() for n, c in files.items()})
    return versions


def main() -> int:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--kills", type=int, required=True)
    kills = arguments.parse_args().kills
    versions, start = two_versions("published_two_benches"), time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        within, looked = exports_with_kills(Path(folder), versions, kills, seed=1)
    size = sum(map(len, versions[0].values())) / 1e6
    print(
        f"{kills} kills of exports of {len(versions[0])} files ({size:.1f} MB), {within} in mid-writing: "
        f"{looked} files looked at, none torn or missing; {time.perf_counter() - start:.0f} s"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
