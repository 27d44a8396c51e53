"""The spec that `planner init` writes."""

from __future__ import annotations

from planner.spec.starter import starter_text
from tests.spec.example import loaded


def test_the_starter_loads_without_a_single_remark() -> None:
    assert loaded(starter_text()).warnings == ()


def test_one_static_record_serves_both_sensors() -> None:
    spec = loaded(starter_text()).spec
    assert spec.tests["static"].calibrates == ("gyro.bias", "accelerometer.bias")
    assert spec.sensitivities == "simulated"


def test_every_section_is_explained() -> None:
    lines = starter_text().splitlines()
    for number, line in enumerate(lines):
        if line and line[0].isalpha() and line.endswith(":") and not line.startswith("plan:"):
            block = lines[max(0, number - 6) : number + 6]
            assert any("#" in one for one in block), line
