"""Several benches by one run: what must wait waits, what need not does not, and one that stops stops all."""

import json
import threading
from functools import cache

import pytest

from planner.bench_run import limits
from planner.bench_run.equipment import BenchLines, Equipment
from planner.bench_run.errors import BenchFault
from planner.bench_run.job import job_from
from planner.bench_run.journal import open_journal
from planner.bench_run.side_by_side import execute_side_by_side, gates_of
from planner.bench_run.simulator.chamber import Chamber
from planner.bench_run.simulator.faults import Faulty, fault_from_text
from planner.bench_run.simulator.server import SimulatedBench
from planner.bench_run.simulator.table import Table
from planner.cli import app
from planner.errors import InputError
from planner.export.json import document_text, plan_document
from tests.bench_run.memory_line import MemoryLine, VirtualClock
from tests.specs import planned, small, with_plan


@cache
def document() -> dict:
    """Three batches through two benches, each of them busy with another batch."""
    spec = small(requirement=[{"error": "position", "limit": "100 m", "rule": "worst_case"}])
    bench = spec["benches"]["rate_table"]
    spec["benches"] = {name: bench | {"kind": "rate_table"} for name in ("one", "two")}
    for test, name in zip(spec["tests"].values(), spec["benches"], strict=True):
        test["bench"] = name
    fixed = {name: {"temperatures": ["-40 degC"], "repeats": 2} for name in spec["tests"]}
    return plan_document(planned(with_plan(spec, units=3, fixed=fixed)).plan)


class TwoBenches:
    """Two simulated benches of one clock."""

    def __init__(self, *faults: str) -> None:
        self.job = job_from(document())
        self.clock, self.said, self.left = VirtualClock(), [], []
        self.tables = {name: Table(self.clock, 3) for name in ("one", "two")}
        self.chambers = {name: Chamber(self.clock) for name in ("one", "two")}
        found = [fault_from_text(text) for text in faults]
        self.lines = {
            name: BenchLines(
                self.line(self.tables[name], found if name == "two" else []),
                self.line(self.chambers[name], []),
            )
            for name in ("one", "two")
        }

    def line(self, device, faults):
        return MemoryLine(Faulty(device, faults, now=self.clock.now), self.clock)

    def run(self, path, resume=False):
        lanes = [[s.id for s in self.job.on(name).steps] for name in ("one", "two")]
        ids = [s.id for s in self.job.steps]
        journal = open_journal(path, self.job.plan_sha256, ids, resume=resume, lanes=lanes)
        try:
            equipment = Equipment(self.lines, self.clock)
            hears = self.said.append, lambda step: None, self.left.append, lambda status: None
            return execute_side_by_side(self.job, equipment, journal, *hears)
        finally:
            journal.close()


def test_one_command_runs_both_over_tcp(tmp_path):
    """Two simulators, each with its own clock, moved together."""
    plan = tmp_path / "plan.json"
    plan.write_text(document_text(document()))
    words, ports = ["run", str(plan), "--page", str(tmp_path / "run.html")], []
    with SimulatedBench() as one, SimulatedBench() as two:
        for name, bench in (("one", one), ("two", two)):
            words += ["--table", f"{name}=TCPIP::127.0.0.1::{bench.ports.table}::SOCKET"]
            words += ["--chamber", f"{name}=TCPIP::127.0.0.1::{bench.ports.chamber}::SOCKET"]
            ports += ["--clock-port", str(bench.ports.clock)]
        shared = [
            "run",
            str(plan),
            "--table",
            f"TCPIP::127.0.0.1::{one.ports.table}::SOCKET",
            "--chamber",
            "x",
        ]
        with pytest.raises(InputError, match="cannot have one table"):
            app(shared, standalone_mode=False)
        app([*words, *ports], standalone_mode=False)
    assert len(told(tmp_path / "run.jsonl")) == len(job_from(document()).steps)
    assert "seen at zero rate" in (tmp_path / "run.html").read_text()


def told(path):
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    return {line["step"]: line for line in lines if "step" in line}


def test_benches_work_at_the_same_time_and_wait_where_the_plan_says_so(tmp_path):
    rig, path = TwoBenches(), tmp_path / "run.jsonl"
    assert limits.side_by_side(rig.job)
    done = rig.run(path)
    entries = told(path)
    assert done.steps == len(rig.job.steps) == len(entries)
    gates = gates_of(rig.job, "two")
    assert len(gates) == 3
    for first, before in gates.items():
        assert len(before) == 1
        assert all(entries[step]["end_s"] <= entries[first]["start_s"] for step in before)
    ends = max(entry["end_s"] for entry in entries.values())
    alone = sum(s.seconds for s in rig.job.steps)
    assert ends < 0.85 * alone  # they did work at the same time
    assert ends == pytest.approx(rig.job.steps[-1].end_s, rel=0.1)
    assert str(rig.left[0]).count("seen at zero rate") == 2


def test_one_bench_that_stops_stops_the_other_and_both_are_left_safe(tmp_path):
    rig, path = TwoBenches("refused_command@40"), tmp_path / "run.jsonl"
    with pytest.raises(BenchFault, match="error at"):
        rig.run(path)
    assert rig.left[0].safe
    assert str(rig.left[0]).count("seen at zero rate") == 2
    assert all(chamber.setpoint_degc == 20.0 for chamber in rig.chambers.values())
    before = len(told(path))
    assert 0 < before < len(rig.job.steps)
    again = TwoBenches()
    assert again.run(path, resume=True).steps == len(rig.job.steps) - before
    assert len(told(path)) == len(rig.job.steps)
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    numbers = [line["power_on"] for line in lines if next(iter(line)) == "power_on"]
    assert numbers == list(range(1, len(numbers) + 1))
    assert threading.active_count() < 20
