"""How fast a campaign runs on the simulator, in memory and over TCP.

First the answer: no command refused, every record at the angles, rates and temperature of the plan for the
planned time (in memory), every step in the journal once. Then the steps per second.

    python benchmarks/bench_simulator.py
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

import yaml

sys.path.insert(0, str(Path(__file__).parents[1]))  # the rig is the tests' own

from planner.bench_run import session
from planner.bench_run.job import Job, job_from
from planner.bench_run.simulator.server import SimulatedBench
from planner.export.json import plan_document
from tests.bench_run.rig import Rig, compare
from tests.specs import SHIPPED, planned

LEAST_IN_MEMORY, LEAST_OVER_TCP = 500.0, 50.0  # steps a second


def shipped_job() -> Job:
    """The plan of high_g on an arm of 1.5 m; the genetic comparison is cut short, it decides no step."""
    spec = yaml.safe_load((SHIPPED / "high_g.yaml").read_text())
    spec["plan"] = spec["plan"] | {"genetic": {"generations": 1, "individuals": 4, "best": 2}}
    return job_from(plan_document(planned(spec).plan), arm_m=1.5)


def in_memory(job: Job, folder: Path) -> float:
    rig = Rig()
    start = time.perf_counter()
    rig.run(job, folder / "memory.jsonl")
    spent = time.perf_counter() - start
    assert not rig.table.refusals
    assert not rig.chamber.refusals
    records = [step for step in job.steps if step.action == "record"]
    for step, (name, begin, end, _) in zip(records, rig.recorder.made, strict=True):
        assert step.id == name
        compare(rig, job.benches[step.bench], step, begin, end)
    return len(job.steps) / spent


def over_tcp(job: Job, folder: Path) -> float:
    path = folder / "tcp.jsonl"
    with SimulatedBench() as bench:
        request = session.Request(
            tables=(f"TCPIP::127.0.0.1::{bench.ports.table}::SOCKET",),
            chambers=(f"TCPIP::127.0.0.1::{bench.ports.chamber}::SOCKET",),
            journal=path,
            clock_ports=(bench.ports.clock,),
        )
        start = time.perf_counter()
        session.run(job, request, lambda text: None)
        spent = time.perf_counter() - start
        assert not bench.table.refusals
        assert not bench.chamber.refusals
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert [line["step"] for line in lines if "step" in line] == [step.id for step in job.steps]
    return len(job.steps) / spent


def main() -> int:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        job = shipped_job()
        memory, tcp = in_memory(job, folder), over_tcp(job, folder)
    days = (job.steps[-1].end_s - job.steps[0].start_s) / 86400
    print(f"{len(job.steps)} steps, {days:.2f} days of bench time; steps a second, journal fsynced at each")
    print(f"in memory {memory:10.0f}\nover TCP  {tcp:10.0f}")
    return 0 if memory >= LEAST_IN_MEMORY and tcp >= LEAST_OVER_TCP else 1


if __name__ == "__main__":
    sys.exit(main())
