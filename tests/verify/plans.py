"""Plans for the tests of verification: small specs, planned once; and edits that are sealed again."""

from __future__ import annotations

import copy
import json
from dataclasses import dataclass
from functools import cache
from typing import Any

import pytest

from planner.export.header import plan_sha256
from planner.export.json import plan_text
from planner.nouns.trajectory import Trajectory
from planner.pipelines.planning import exact_plan
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.load import LoadedSpec
from planner.verify.monte_carlo import fly
from planner.verify.outcome import outcomes
from planner.verify.prediction import Prediction
from planner.verify.workers import here
from tests.specs import loaded, planned, shared, small


@dataclass(frozen=True)
class Planned:
    """A spec with its plan's tree and its flight."""

    loaded: LoadedSpec
    document: dict[str, Any]
    trajectory: Trajectory


def flown(**changes: Any) -> dict[str, Any]:
    """A level minute flown without aiding: six faces, two sensors, every sensitivity simulated."""
    spec = small() | {
        "name": "flown",
        "requirement": [{"error": "position", "limit": "480 m", "rule": "worst_case"}],
        "trajectory": {"name": "level", "duration": "60 s", "sampling_rate": "50 Hz"},
        "sensitivities": "simulated",
        "effects": ["bias", "bias_temperature", "scale_factor"],
        "tests": {
            "static": {
                "bench": "rate_table",
                "calibrates": ["gyro.bias", "accelerometer.bias"],
                "motions": 6,
                "record": "60 s",
                "power_on": "30 s",
                "cool_down": "5 min",
            },
            "rates": {
                "bench": "rate_table",
                "calibrates": ["gyro.scale_factor"],
                "motions": 6,
                "record": "20 s",
                "cool_down": "1 min",
            },
        },
    }
    unit = copy.deepcopy(spec["unit"])
    unit["gyro"]["scale_factor"] = {"systematic": "0.5 %", "run_to_run": "0.003 %", "storage": "0.002 %"}
    bench = spec["benches"]["rate_table"] | {"axes": 2, "move": "5 s", "limits": {"rate": "600 deg/s"}}
    return spec | {"unit": unit, "benches": {"rate_table": bench}} | changes


def attended() -> dict[str, Any]:
    """The same with people who install in the working week, loads on two tables, overlapping cool-downs."""
    spec = flown(name="attended")
    bench = spec["benches"]["rate_table"] | {"units": 2, "count": 2, "remove": "10 min"}
    shifts = [{"days": ["mon", "tue", "wed", "thu", "fri"], "from": "08:00", "to": "17:00"}]
    plan = spec["plan"] | {"shifts": shifts, "units": 5, "overlap": ["cool_down"]}
    return spec | {"benches": {"rate_table": bench}, "plan": plan}


def several() -> dict[str, Any]:
    """Two requirements, a percentile at any moment and rss at a time; Student's quantile."""
    spec = flown(name="several")
    wanted = [
        {"error": "horizontal", "limit": "220 m", "rule": {"percentile": "95 %"}},
        {"error": "heading", "limit": "0.25 deg", "rule": "rss", "at": "30 s"},
        {"error": "velocity", "limit": "7.9 m/s", "rule": {"percentile": "90 %"}, "at": "any"},
    ]
    return spec | {
        "requirement": wanted,
        "plan": spec["plan"] | {"quantile": "student", "method": "published"},
    }


def informed() -> dict[str, Any]:
    """The same requirements at temperatures of their own, by information; by hand, so that none searches.

    Its curves name their family: to find the worst start at any moment takes four seconds a family.
    """
    spec = several()
    for sensor in spec["unit"].values():
        sensor["bias"]["temperature_residual"] |= {"curve": "kink"}
    where: list[Any] = ["range", {"distribution": {"-20 degC": 1, "30 degC": 3}}, "worst"]
    wanted = [r | {"temperature": t} for r, t in zip(spec["requirement"], where, strict=True)]
    fixed = {
        "static": {"temperatures": ["-50 degC", "0 degC", "50 degC"], "repeats": 2},
        "rates": {"temperatures": ["0 degC"], "repeats": 2},
    }
    plan = spec["plan"] | {"method": "information", "fixed": fixed}
    return spec | {"name": "informed", "requirement": wanted, "plan": plan}


SPECS = {
    "small": small,
    "shared": shared,
    "flown": flown,
    "attended": attended,
    "several": several,
    "informed": informed,
}


@cache
def plan_of(name: str) -> Planned:
    """A spec by its name, planned; the tree must be copied before it is changed."""
    return planned_from(SPECS[name](), with_genetic=name == "small")


def planned_from(spec: dict[str, Any], *, with_genetic: bool = False) -> Planned:
    """Any spec, planned; without the genetic algorithm beside it the same campaign is found in less time."""
    one = loaded(spec)
    document = json.loads(plan_text(planned(spec).plan if with_genetic else exact_plan(one)))
    return Planned(one, document, trajectory_of(one.spec.trajectory, one.folder))


def sealed_again(document: dict[str, Any]) -> dict[str, Any]:
    """The tree with the hash of its content, as if planner had written it so."""
    return document | {"plan_sha256": plan_sha256(document)}


def assert_flown_as_foreseen(one: Planned, foreseen: Prediction, flights: int, rel: float) -> None:
    """Nonlinear flights of calibrated units reach what verify's own linear model foretells of the plan."""
    flown = fly(foreseen.e, flights, here, lambda message: None)
    for o in outcomes(foreseen.e, flown.tally, one.document, foreseen.e.spec):
        figure = max(foreseen.figures(o.index, foreseen.e.starts, ("cosines",)).values())
        assert figure == pytest.approx(o.at_promise, rel=rel)
