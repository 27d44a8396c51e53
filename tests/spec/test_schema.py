"""The JSON Schema accepts what planner ships, underlines what an editor can see, and describes every key."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from planner import catalog
from planner.spec.model import Spec
from planner.spec.schema import json_schema
from planner.spec.starter import starter_text
from planner.spec.yaml12 import read_yaml
from tests.spec.example import EXAMPLE, changed, faults, loaded

SHIPPED = sorted((Path(__file__).parents[2] / "requirements_specs").glob("*.yaml"))


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def as_json(text: str) -> Any:
    """What an editor sees: JSON has text as keys only."""
    return json.loads(json.dumps(read_yaml(text.encode(), "spec.yaml").value))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_spec_is_valid(path: Path, validator: jsonschema.Draft202012Validator) -> None:
    validator.validate(as_json(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize("text", [EXAMPLE, starter_text()], ids=["interfaces", "starter"])
def test_the_example_and_the_starter_are_valid(text: str, validator: jsonschema.Draft202012Validator) -> None:
    validator.validate(as_json(text))


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ("limit: 10 m", "limit: 10", "requirement"),
        ("in_run: 0.001 deg/s", "in_run: 0.001", "unit.gyro.bias.in_run"),
        ("in_run: 0.001 deg/s", "in_run: nan deg/s", "unit.gyro.bias.in_run"),
        ("confidence: 95 %", "confidense: 95 %", "plan"),
        ("error: position", "error: positon", "requirement"),
        ("range: [-65 degC", "range: [-65", "benches.rate_table.chamber.range.0"),
        ("range: [-65 degC, 85 degC]", "range: [-65 degC]", "benches.rate_table.chamber.range"),
        ("calibrates: gyro.scale_factor", "calibrates: gyro.scale", "tests.rates.calibrates"),
        (", misalignment]", ", misalignement]", "effects.4"),
        ("  gyro:\n    bias:", "  gyro:\n    bais:", "unit.gyro"),
        ("    scale_factor: {sys", "    g_sensitivity: {sys", "unit.accelerometer"),
        ("units: 4", "units: 0", "benches.rate_table.units"),
        ("units: 4", "units: four", "benches.rate_table.units"),
        ("{1: 0.032", "{one: 0.032", "unit.gyro.bias.temperature_residual"),
        ("{-55 degC: 0.02 %", "{-55: 0.02 %", "unit.gyro.scale_factor.run_to_run"),
        ("small_uav_1", "small_uav_7", "trajectory"),
        ("quantile: student", "quantile: yes", "plan.quantile"),
        ("repeats: {least: 2", "repeats: {least: 2.5", "plan.repeats.least"),
        ("    axes: 2\n", "    axes: 2\n    kind: rate_tabel\n", "benches.rate_table.kind"),
        ("in_run: 0.001 deg/s", "in_run:", "unit.gyro.bias.in_run"),
        ("name: small UAV, one minute without aiding\n", "", ""),
        ("worst_case}", "rss, temperature: wurst}", "requirement"),
        ("worst_case}", "rss, temperature: {distribution: {20: 1}}}", "requirement"),
        ("run_to_run: 1 mg", "run_to_run: {value: 1 mg, power_ons: 1}", "unit.accelerometer.bias.run_to_run"),
        ("{1: 0.032 deg/s", "{curve: kinck, 1: 0.032 deg/s", "unit.gyro.bias.temperature_residual"),
        (
            "{curve: {-60 degC: 5 mg, 20 degC: 0 mg, 60 degC: -3 mg}}",
            "{curve: [{0 degC: 5 mg, 20 degC: 0 mg}, {0 degC: 1 mg, 60 degC: -3 mg}]}",
            "unit.accelerometer.bias.temperature_residual",
        ),
        ("confidence: 95 %", "method: informaton", "plan.method"),
        ("confidence: 95 %", "redundancy: 2", "plan.redundancy"),
    ],
)
def test_an_editor_underlines_what_check_refuses(
    old: str, new: str, where: str, validator: jsonschema.Draft202012Validator
) -> None:
    text = changed((old, new))
    found = {".".join(map(str, error.absolute_path)) for error in validator.iter_errors(as_json(text))}
    assert where in found
    assert faults(text)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("worst_case}", "rss, temperature: worst}"),
        ("worst_case}", "rss, temperature: {distribution: {-20 degC: 0.2, 60 degC: 1}}}"),
        ("run_to_run: 1 mg", "run_to_run: {value: {0 degC: 1 mg, 9 degC: 2 mg}, power_ons: 12}"),
        ("{-55 degC: 0.02 %, 20 degC: 0.01 %, 65 degC: 0.03 %}", "{10 deg/s: 0.11 %, 500 deg/s: 0.12 %}"),
        (
            "{-55 degC: 0.02 %, 20 degC: 0.01 %, 65 degC: 0.03 %}",
            "{value: {10 rpm: 0.11 %, 8 rad/s: 0.1 %}, power_ons: 20}",
        ),
        ("{1: 0.032 deg/s", "{curve: kink, figure: sigma, 1: 0.032 deg/s"),
        (
            "{curve: {-60 degC: 5 mg, 20 degC: 0 mg, 60 degC: -3 mg}}",
            "{curve: [{0 degC: 5 mg, 20 degC: 0 g}, {0 degC: 1 g, 9 degC: 3 g}, {1 degC: 1 g, 2 degC: 0 g}]}",
        ),
        ("confidence: 95 %", "method: published\n  temperature_estimator: lines\n  redundancy: 0"),
    ],
)
def test_an_editor_accepts_what_check_accepts(
    old: str, new: str, validator: jsonschema.Draft202012Validator
) -> None:
    text = changed((old, new))
    validator.validate(as_json(text))
    loaded(text)


def properties(node: Any, path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    if isinstance(node, dict):
        for key, field in node.get("properties", {}).items():
            yield f"{path}.{key}", field
    for key, inner in (
        node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    ):
        yield from properties(inner, f"{path}.{key}")


def test_every_key_is_described() -> None:
    found = dict(properties(json_schema()))
    assert len(found) > 60
    assert [path for path, field in found.items() if "description" not in field] == []


def test_it_knows_todays_plug_ins_and_every_key_of_the_model() -> None:
    schema = json_schema()
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert set(schema["properties"]) == set(Spec.model_fields)
    listed, described = schema["properties"]["effects"]["items"]["anyOf"]
    assert listed["enum"] == list(catalog.effects())
    assert re.search(described["pattern"], "curve_gyro_y_over_time_on_at_0_600_3600")
    assert not re.search(described["pattern"], "scale_factr")
    assert schema["$defs"]["Bench"]["properties"]["kind"]["enum"] == list(catalog.benches())


def test_it_is_the_same_at_every_call() -> None:
    assert json.dumps(json_schema()) == json.dumps(json_schema())
