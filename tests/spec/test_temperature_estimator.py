"""Which plans may rest on smooth tables."""

from __future__ import annotations

from typing import Any

import pytest
import yaml

from planner.errors import InputError
from planner.spec.load import LoadedSpec, spec_from_bytes
from tests.specs import ROOT
from tests.verify.plans import informed, small


def smooth(spec: dict[str, Any]) -> LoadedSpec:
    tree = spec | {"plan": spec["plan"] | {"temperature_estimator": "smooth"}}
    return spec_from_bytes(yaml.safe_dump(tree, allow_unicode=True).encode(), ROOT / "smooth.yaml")


def test_a_plan_by_information_may() -> None:
    found = smooth(informed())
    assert found.spec.plan.temperature_estimator == "smooth"
    assert not [w for w in found.warnings if "temperature_estimator" in w.path]


@pytest.mark.parametrize("case", ["asked for", "worst_case", "given"])
def test_the_published_method_may_not(case: str) -> None:
    spec = small() if case == "given" else informed()
    if case == "asked for":
        spec |= {"plan": spec["plan"] | {"method": "published"}}
    if case == "worst_case":
        spec |= {"requirement": [{"error": "horizontal", "limit": "900 m", "rule": "worst_case"}]}
    with pytest.raises(InputError) as refused:
        smooth(spec)
    (fault,) = [f for f in refused.value.faults if f.path == "plan.temperature_estimator"]
    assert "smooth goes with method information" in fault.message
    assert "write lines, or plan by information" in fault.message


def test_without_a_curve_it_says_nothing() -> None:
    spec = informed()
    unit = {
        sensor: {
            error: {key: value for key, value in budget.items() if key != "temperature_residual"}
            for error, budget in spec["unit"][sensor].items()
        }
        for sensor in ("gyro", "accelerometer")
    }
    warned = [w.message for w in smooth(spec | {"unit": unit}).warnings if "temperature_estimator" in w.path]
    assert len(warned) == 1
    assert "no error has a temperature_residual" in warned[0]
