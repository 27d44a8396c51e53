"""Every step of every shipped spec's plan, executed on the simulator, compared with the plan."""

import json
import math
import os

import pytest

from planner.bench_run import limits
from planner.bench_run.job import job_from
from planner.control.orders import orders
from tests.bench_run.rig import Rig
from tests.shipped_plans import NAMES, shipped_document

ARM_M = 1.5  # the published specs do not tell the arm of their centrifuge


@pytest.mark.parametrize("name", NAMES)
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


def compare(rig, bench, step, start, end):
    assert end - start == pytest.approx(step.end_s - step.start_s, abs=1e-6)
    for time in (start, (start + end) / 2, end):
        if bench.chamber is not None:  # tenths of the controller, and the runner's tolerance of settling
            assert rig.chamber.at(time) == pytest.approx(step.temperature_degc, abs=0.5 + 0.05)
        for order in orders(step.motion, bench):
            position, rate = rig.table.at(order.axis, time)
            if order.mode == "rate":  # 1e-6 deg/s is the last digit that is sent
                assert rate == pytest.approx(order.value, abs=1e-5 + 1e-4 * abs(order.value) + 0.01)
            else:
                off = math.remainder(position - order.value, 360.0)
                assert abs(off) <= 0.01
                assert rate == pytest.approx(0.0, abs=0.5)
