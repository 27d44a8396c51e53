"""Every step of every shipped spec's plan, executed on the simulator, compared with the plan."""

import json
import math
import os
from functools import cache

import pytest
import yaml

from planner.export.json import plan_document
from planner.run import limits
from planner.run.job import job_from
from planner.run.motion import orders
from tests.run.rig import Rig
from tests.specs import SHIPPED, planned

NAMES = sorted(path.stem for path in SHIPPED.glob("*.yaml"))
ARM_M = 1.5  # the published specs do not tell the arm of their centrifuge


@cache
def document(name: str) -> dict:
    """The plan of a shipped spec. The genetic comparison is cut short: it decides no step."""
    spec = yaml.safe_load((SHIPPED / f"{name}.yaml").read_text())
    spec["plan"] = spec.get("plan", {}) | {
        "genetic": {"generations": 1, "individuals": 4, "best": 2},
        "time_limit": "1 s",
    }
    return plan_document(planned(spec).plan)


@pytest.mark.parametrize("name", NAMES)
def test_the_simulator_sees_the_angles_rates_temperatures_and_times_of_the_plan(name, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda handle: None)  # 12 000 steps; what the disk does is not at stake
    job = job_from(document(name), arm_m=ARM_M)
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
