"""Small specs for tests: published coefficients, so that no trajectory has to be flown."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import yaml

from planner.nouns.plan import Plan
from planner.pipelines import planning as pipeline
from planner.pipelines.planned import Planned
from planner.spec.load import LoadedSpec, load_spec, spec_from_bytes
from planner.spec.starter import starter_text

ROOT = Path(__file__).parents[1]
SHIPPED = ROOT / "requirements_specs"


def small(**changes: object) -> dict:
    """Two errors, two tests on one bench with a chamber; `changes` replace top-level parts."""
    spec = {
        "planner": 1,
        "name": "small",
        "requirement": [{"error": "position", "limit": "10 m", "rule": "worst_case"}],
        "trajectory": "static",
        "sensitivities": {"given": {"gyro.bias": "578.5 m/(deg/s)", "accelerometer.bias": "311.25 m/g"}},
        "unit": {
            "gyro": {
                "bias": {
                    "systematic": "0.03 deg/s",
                    "run_to_run": "0.002 deg/s",
                    "in_run": "0.001 deg/s",
                    "storage": "0.001 deg/s",
                    "temperature_residual": {1: "0.032 deg/s", 3: "0.0085 deg/s", 5: "0.0035 deg/s"},
                }
            },
            "accelerometer": {
                "bias": {
                    "systematic": "0.02 g",
                    "run_to_run": "0.001 g",
                    "in_run": "0.0005 g",
                    "storage": "0.001 g",
                    "temperature_residual": {1: "0.024 g", 3: "0.0061 g", 5: "0.0033 g"},
                }
            },
        },
        "effects": ["bias", "bias_temperature"],
        "benches": {
            "rate_table": {
                "install": "30 min",
                "chamber": {
                    "range": ["-65 degC", "85 degC"],
                    "heating": "4 K/min",
                    "cooling": "2 K/min",
                    "soak": "30 min",
                },
            }
        },
        "tests": {
            "gyro_drift": {
                "bench": "rate_table",
                "calibrates": ["gyro.bias"],
                "record": "300 s",
                "gap": "15 min",
            },
            "accelerometer_drift": {
                "bench": "rate_table",
                "calibrates": ["accelerometer.bias"],
                "record": "300 s",
                "gap": "15 min",
            },
        },
        "plan": {
            "confidence": "95 %",
            "quantile": "normal",
            "temperatures": {"range": ["-60 degC", "60 degC"], "candidates": [1, 3, 5]},
            "repeats": {"least": 2, "most": 40},
            "genetic": {"generations": 30},
        },
    }
    return spec | changes


def shared() -> dict:
    """The same errors from one static record."""
    spec = small()
    record = {"bench": "rate_table", "record": "300 s", "gap": "15 min"}
    return spec | {"tests": {"static": record | {"calibrates": ["gyro.bias", "accelerometer.bias"]}}}


@cache
def shipped(name: str) -> LoadedSpec:
    """A spec of requirements_specs by its name, or the `starter` that `planner init` writes; read once."""
    if name == "starter":
        return spec_from_bytes(starter_text().encode(), Path("starter.yaml"))
    return load_spec(SHIPPED / f"{name}.yaml")


def loaded(spec: dict) -> LoadedSpec:
    """A spec as if it had come from a file."""
    return spec_from_bytes(yaml.safe_dump(spec, sort_keys=False).encode(), Path("spec.yaml"))


def planned(spec: dict) -> Planned:
    """The spec, planned."""
    return pipeline.plan(loaded(spec), lambda message: None)


def planned_exactly(spec: dict) -> Plan:
    """The spec's plan alone: without the genetic algorithm beside it the same campaign takes less time."""
    return pipeline.exact_plan(loaded(spec))


def with_limit(spec: dict, limit: str, **requirement: object) -> dict:
    """The spec with another limit."""
    return spec | {"requirement": [spec["requirement"][0] | {"limit": limit} | requirement]}


def with_plan(spec: dict, **plan: object) -> dict:
    """The spec with other planning choices."""
    return spec | {"plan": spec["plan"] | plan}
