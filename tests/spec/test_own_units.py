"""An error is shown in the unit in which the spec speaks of it, everywhere the same."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from planner.export.json import plan_document
from planner.pipelines import planning as pipeline
from planner.pipelines.planned import Planned
from planner.report.blocks import Table
from planner.report.subjects.plan import plan_report
from planner.spec.budget import ErrorBudget
from planner.spec.load import load_spec, spec_from_bytes
from planner.spec.own_units import budget_unit, own_units
from planner.units import unit_factor
from tests.specs import SHIPPED, small


def budget(**parts: object) -> ErrorBudget:
    return ErrorBudget.model_validate(parts)


@pytest.mark.parametrize(
    ("parts", "unit"),
    [
        ({"run_to_run": "2 deg/h"}, "deg/h"),
        ({"systematic": "0.1 deg/s", "run_to_run": "2 deg/h", "in_run": "1 deg/h"}, "deg/h"),
        ({"systematic": "4 mg", "storage": "100 micro-g"}, "mg"),  # of equally many the first
        ({"run_to_run": {"value": {"-40 degC": "1 ppm", "20 degC": "2 ppm"}, "power_ons": 9}}, "ppm"),
        ({"temperature_residual": {"curve": {"0 degC": "1 mg", "9 degC": "2 mg"}}}, "mg"),
        ({}, "deg/s"),
    ],
)
def test_the_unit_of_most_figures_is_taken(parts: dict, unit: str) -> None:
    assert budget_unit(budget(**parts), "deg/s") == unit


@given(st.sampled_from(["deg/h", "deg/s", "arcsec/s", "rad/s"]), st.floats(1e-6, 1e6))
def test_one_unit_alone_is_kept_whatever_the_size(unit: str, size: float) -> None:
    assert budget_unit(budget(run_to_run=f"{size:.6e} {unit}"), "deg/s") == unit


def test_a_shipped_spec_is_shown_as_it_is_written() -> None:
    units = own_units(load_spec(SHIPPED / "tactical_leg.yaml").spec)
    assert units["gyro.bias"] == "deg/h"
    assert units["accelerometer.bias"] == "micro-g"
    assert units["gyro.scale_factor"] == "ppm"
    assert units["gyro.misalignment"] == "arcsec"


def in_other_units() -> dict:
    """The small spec's budget in deg/h and mg."""

    def other(written: object) -> object:
        if isinstance(written, dict):
            return {key: other(value) for key, value in written.items()}
        number, unit = str(written).split()
        factor, name = {"deg/s": (3600.0, "deg/h"), "g": (1000.0, "mg")}[unit]
        return f"{float(number) * factor:.10g} {name}"

    spec = small()
    return spec | {"unit": other(spec["unit"])}


def planned(spec: dict) -> Planned:
    return pipeline.plan(spec_from_bytes(yaml.safe_dump(spec).encode(), Path("spec.yaml")), lambda said: None)


def in_si(allowance: dict) -> float:
    return allowance["allowed"] * unit_factor(allowance["unit"])[0]


def test_the_unit_changes_no_figure_and_stands_in_plan_json_and_report() -> None:
    plain, own = (planned(spec) for spec in (small(), in_other_units()))
    assert own.plan.time_s == plain.plan.time_s
    documents = [plan_document(p.plan) for p in (plain, own)]
    assert [d["allowances"]["gyro.bias"]["unit"] for d in documents] == ["deg/s", "deg/h"]
    assert [d["allowances"]["accelerometer.bias"]["unit"] for d in documents] == ["g", "mg"]
    for error in ("gyro.bias", "accelerometer.bias"):
        before, after = (
            d["allowances"][error]["allowed"] * unit_factor(d["allowances"][error]["unit"])[0]
            for d in documents
        )
        assert after == pytest.approx(before, rel=1e-9)  # figures of plan.json have twelve digits
    tables = [b for s in plan_report(own.plan).sections for b in s.blocks if isinstance(b, Table)]
    cells = {
        str(row[0]).replace("\u200b", ""): row[1]
        for t in tables
        for row in t.rows
        if t.columns[:2] == ("error", "unit")
    }
    assert cells == {"gyro.bias": "deg/h", "accelerometer.bias": "mg"}
