"""A table over temperature and its rate (K 2.4.2): what the plan promises of it, `verify` counts."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import pytest

from planner.errors import InputError
from planner.information import pareto
from planner.pipelines.promise import FlightOptions, verify
from tests.specs import small
from tests.verify.plans import Planned, planned_from

NODES = (-60.0, -20.0, 0.0, 20.0, 40.0, 60.0)  # degC, of the tables


def spec(effect: str) -> dict[str, Any]:
    """Faces in a soaked chamber and on ramps, gyros alone; free temperatures."""
    made = copy.deepcopy(small())
    bias = {
        "systematic": "0.03 deg/s",
        "run_to_run": "0.002 deg/s",
        "in_run": "0.0005 deg/s",
        "temperature_residual": {1: "0.032 deg/s", 3: "0.0085 deg/s", 5: "0.0035 deg/s"},
    }
    table = {"systematic": "0.5 deg/s", "run_to_run": "0.01 deg/s"}
    bench = made["benches"]["rate_table"] | {"axes": 2, "move": "5 s"}
    soaked = {"bench": "rate_table", "calibrates": ["gyro.bias"], "motions": 4, "record": "60 s"}
    soaked |= {"power_on": "30 s", "cool_down": "5 min"}
    return made | {
        "requirement": [{"error": "position", "limit": "300 m", "rule": {"percentile": "95 %"}}],
        "trajectory": {"name": "level", "duration": "60 s", "sampling_rate": "10 Hz"},
        "sensitivities": "simulated",
        "unit": {"noise": {"gyro": "0.1 deg/sqrt(h)"}, "gyro": {"bias": bias, effect: table}},
        "effects": ["bias", "bias_temperature", effect],
        "benches": {"rate_table": bench},
        "tests": {"static": soaked, "ramps": soaked | {"temperature": {"ramp": "1 K/min", "lead": "60 s"}}},
        "plan": {
            "temperatures": {"range": ["-60 degC", "60 degC"], "step": "10 K"},
            "repeats": {"least": 2, "most": 4},
        },
    }


def test_what_is_promised_of_a_rate_table_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes that no record comes near are known to neither; the points of the front have their ramps."""
    monkeypatch.setattr(pareto, "SHOWN", 3)  # points, the shortest and the most accurate among them
    one = planned_from(spec("temperature_rate_table"), with_genetic=True)
    (ramps,) = (t["temperatures_degc"] for t in one.document["tests"] if t["test"] == "ramps")
    assert all(min(abs(t - node) for t in ramps) < 32.0 for node in NODES)
    assert counted(one)
    assert "ramps" in [v["test"] for campaign in one.document["genetic"]["campaigns"] for v in campaign]


def test_what_is_promised_of_a_rate_table_over_time_is_counted() -> None:
    """By hand, at every node."""
    assert counted(planned_from(by_hand(NODES)))


def test_nodes_that_hands_left_out_are_refused_by_their_names() -> None:
    """They made figures that are infinite, and those a plan.json that could not be written."""
    with pytest.raises(InputError, match=r"fixed by hand does not tell gyro.*0 degC -2 K/min"):
        planned_from(by_hand([t for t in NODES if abs(t) in (20.0, 60.0)]))


def by_hand(degc: Sequence[float]) -> dict[str, Any]:
    made = spec("temperature_rate_table_over_time")
    at = [f"{t:g} degC" for t in degc]
    fixed = {test: {"temperatures": at, "repeats": 2} for test in made["tests"]}
    made["requirement"][0]["limit"] = "100 km"
    return made | {"plan": made["plan"] | {"fixed": fixed}}


def counted(one: Planned) -> bool:
    """Whether verify counts what was planned."""
    found = verify(one.loaded, one.document, FlightOptions(flights=0), lambda message: None)
    assert found.recount.ok, found.recount.faults[:3]
    return found.recount.ok
