"""Export of a plan of 100 000 steps: every record at its time first, then how long each format takes."""

from __future__ import annotations

import pytest

from planner.catalog import exports
from planner.export.header import check_seal
from planner.export.outputs import collector_paused
from planner.protocols import Exported, ExportOptions
from tests.export import grammar
from tests.export.samples import small

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
