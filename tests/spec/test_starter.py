"""The spec that `planner init` writes."""

from __future__ import annotations

import re

import pytest

from planner.spec.starter import starter_text
from tests.spec.example import loaded


def test_the_starter_loads_without_a_single_remark() -> None:
    assert loaded(starter_text()).warnings == ()


def test_one_static_record_serves_both_sensors() -> None:
    spec = loaded(starter_text()).spec
    both = ("gyro.bias", "accelerometer.bias", "accelerometer.scale_factor")
    assert spec.tests["static"].calibrates == both
    assert spec.sensitivities == "simulated"


@pytest.mark.parametrize("key", ["flown_after", "initial_alignment", "accuracy"])
def test_what_stands_in_a_comment_may_be_taken_out_of_it(key: str) -> None:
    text, count = re.subn(rf"^( *)# ({key}:)", r"\1\2", starter_text(), flags=re.MULTILINE)
    assert count == 1
    assert loaded(text).spec != loaded(starter_text()).spec or key == "flown_after"


@pytest.mark.parametrize("part", ["temperature_correlation", "correlation_time"])
def test_the_longer_forms_in_comments_can_be_written(part: str) -> None:
    text = starter_text()
    (form,) = re.findall(rf"# +or (\{{[^}}]*\b{part}: [^}}]*\}})", text)
    key = {"temperature_correlation": "run_to_run", "correlation_time": "in_run"}[part]
    longer = re.sub(rf"{key}: 0\.00[12] deg/s", f"{key}: {form}", text, count=1)
    assert longer != text
    assert loaded(longer).warnings == ()


def test_every_section_is_explained() -> None:
    lines = starter_text().splitlines()
    for number, line in enumerate(lines):
        if line and line[0].isalpha() and line.endswith(":") and not line.startswith("plan:"):
            block = lines[max(0, number - 6) : number + 6]
            assert any("#" in one for one in block), line
