"""The plan's steps recounted from plan.json and the spec's own words, without the planner's arithmetic."""

import json
from collections import Counter
from itertools import pairwise

import pytest

from planner.export.formats.csv import steps_text
from planner.export.json import plan_document, plan_text
from tests.specs import planned, shared, small, with_limit


def several_motions() -> dict:
    spec = small()
    test = spec["tests"]["gyro_drift"] | {"motions": 6, "record": "20 s", "gap": "2 s", "power_on": "30 s"}
    spec["tests"] = spec["tests"] | {"gyro_drift": test}
    bench = spec["benches"]["rate_table"]
    return spec | {"benches": {"rate_table": bench | {"move": "5 s", "remove": "10 min"}}}


SPECS = {
    "small": small(),
    "shared": shared(),
    "motions": several_motions(),
    "loose": with_limit(small(), "30 m"),
}


@pytest.fixture(params=SPECS, name="document", scope="module")
def _document(request) -> dict:
    return json.loads(plan_text(planned(SPECS[request.param]).plan))


def test_steps_follow_one_another_and_end_at_the_total(document):
    steps = document["steps"]
    assert steps[0]["start_s"] == 0
    for a, b in pairwise(steps):
        assert b["start_s"] == pytest.approx(a["end_s"], abs=1e-6)
        assert b["end_s"] >= b["start_s"]
    assert steps[-1]["end_s"] == pytest.approx(document["time_s"], abs=1e-6)
    assert document["bound_s"] == pytest.approx(document["time_s"], abs=1e-6)


def test_every_repeat_of_every_test_is_there_once(document):
    records = Counter()
    for step in document["steps"]:
        if step["action"] == "record":
            records[step["test"], step["temperature_degc"]] += 1
    expected = {
        (test["test"], t): n * test["motions"]
        for test in document["tests"]
        for t, n in zip(test["temperatures_degc"], test["repeats"], strict=True)
    }
    assert records == expected
    assert len({step["id"] for step in document["steps"]}) == len(document["steps"])


def test_every_power_on_is_followed_by_its_own_power_off(document):
    powered, since, total = None, 0.0, 0.0
    for step in document["steps"]:
        run = (step["test"], step["temperature_degc"], step["repeat"])
        if step["action"] == "power_on":
            assert powered is None
            powered, since = run, step["start_s"]
        elif step["action"] == "power_off":
            assert powered == run
            powered, total = None, total + step["end_s"] - since
        elif step["action"] in ("record", "move", "pause"):
            assert powered == run
        elif step["action"] in ("cool_down", "ramp", "soak", "install", "remove"):
            assert powered is None
    assert total == pytest.approx(document["power_on_s"], abs=1e-6)


def test_a_soak_is_paid_once_per_temperature(document):
    soaks = [step["temperature_degc"] for step in document["steps"] if step["action"] == "soak"]
    visited = {t for test in document["tests"] for t in test["temperatures_degc"]}
    assert sorted(soaks) == sorted(visited)


def test_the_chamber_moves_no_faster_than_it_can(document):
    now = 20.0
    for step in document["steps"]:
        if step["action"] == "ramp":
            minutes = (step["end_s"] - step["start_s"]) / 60
            speed = 4 if step["temperature_degc"] > now else 2
            assert minutes == pytest.approx(abs(step["temperature_degc"] - now) / speed)
            now = step["temperature_degc"]
        elif step["action"] == "record":
            assert step["temperature_degc"] == now
    assert now == 20.0


def test_allowances_add_up_to_the_requirement(document):
    metres = {"gyro.bias": 578.5, "accelerometer.bias": 311.25}
    for allowance in document["allowances"].values():
        assert allowance["allowed"] == pytest.approx(sum(allowance["parts"].values()), rel=1e-9)
    total = sum(metres[e] * a["allowed"] for e, a in document["allowances"].items())
    (requirement,) = document["requirements"]
    assert requirement["achieved"] == pytest.approx(total, rel=1e-9)
    assert requirement["achieved"] <= requirement["limit"]


def test_steps_csv_says_the_same(document):
    plan = planned(small()).plan
    lines = steps_text(plan_document(plan)).splitlines()
    assert len(lines) == 1 + len(plan.steps)
    assert lines[0].startswith("id,bench,action,start_s,end_s,test,temperature_degc,repeat")


@pytest.mark.parametrize("name", SPECS)
def test_the_same_spec_gives_the_same_bytes(name):
    assert plan_text(planned(SPECS[name]).plan) == plan_text(planned(SPECS[name]).plan)


def test_plan_json_holds_every_key_of_the_interfaces():
    document = plan_document(planned(small()).plan)
    assert {
        "planner",
        "spec",
        "seed",
        "requirements",
        "sensitivities",
        "allowances",
        "tests",
        "steps",
        "time_s",
        "bound_s",
        "gap",
        "power_on_s",
        "genetic",
    } <= document.keys()
    assert set(document["genetic"]) >= {"time_s", "gap", "generations", "evaluations", "front"}
    assert set(document["steps"][0]) == {
        "id",
        "bench",
        "action",
        "start_s",
        "end_s",
        "test",
        "temperature_degc",
        "repeat",
        "motion",
        "units",
        "attended",
    }
