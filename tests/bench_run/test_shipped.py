"""Every step of shipped specs' plans, executed on the simulator, compared with the plan."""

import json
import os

import pytest

from planner.bench_run import limits
from planner.bench_run.job import job_from
from tests.bench_run.rig import Rig, compare
from tests.shipped_plans import NAMES, shipped_document

# tables of one to three axes, with a centrifuge beside the first; plans published and by information
KINDS = ("published_two_benches", "small_uav", "tactical_leg")
ARM_M = 1.5  # the published specs do not tell the arm of their centrifuge


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.further("name", [name for name in NAMES if name not in KINDS])
def test_the_simulator_sees_the_angles_rates_temperatures_and_times_of_the_plan(name, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda handle: None)  # 12 000 steps; what the disk does is not at stake
    job = job_from(shipped_document(name), arm_m=ARM_M)
    limits.check(job)
    rig = Rig()
    rig.run(job, tmp_path / "run.jsonl")
    assert rig.table.refusals == []
    assert rig.chamber.refusals == []
    records = [step for step in job.steps if step.action == "record"]
    assert [made[0] for made in rig.recorder.made] == [step.id for step in records]
    for step, (_, start, end, _) in zip(records, rig.recorder.made, strict=True):
        compare(rig, job.benches[step.bench], step, start, end)
    lines = [json.loads(line) for line in (tmp_path / "run.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines if "step" in line] == [step.id for step in job.steps]
