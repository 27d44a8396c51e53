"""Coefficients that a sensor's channels have in common, of the bench: an arm's length, where it stands."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

from planner.information import in_common, told
from planner.verify.prediction import Prediction
from tests.specs import SHIPPED
from tests.verify.plans import Planned, planned_from
from tests.verify.test_recount_promise import by_hand, faults_in, prediction


def on_an_arm() -> dict[str, Any]:
    """Accelerometers whose scale factor six faces tell, and the arm's loads only beside the arm's length."""
    spec = by_hand()
    scale = {"systematic": "0.5 %", "run_to_run": "0.001 %"}
    acc = {"bias": {"systematic": "20 mg", "run_to_run": "1 mg", "in_run": "0.5 mg"}, "scale_factor": scale}
    tests = {
        "loads": {
            "bench": "centrifuge",
            "calibrates": ["accelerometer.bias", "accelerometer.scale_factor"],
            "motions": 24,
            "power_on": "30 s",
            "record": "20 s",
            "temperatures": "room",
        }
    }
    return spec | {
        "name": "on an arm",
        "requirement": [{"error": "position", "limit": "900 km", "rule": "rss"}],
        "unit": {"accelerometer": acc},
        "effects": ["bias", "scale_factor", "arm_length"],
        "benches": {"centrifuge": {"arm": "1.5 m", "limits": {"acceleration": "100 g"}}},
        "tests": tests,
        "plan": {"method": "information", "fixed": {"loads": {"temperatures": "room", "repeats": 3}}},
    }


@pytest.fixture(scope="module", name="one")
def _one() -> Planned:
    return planned_from(on_an_arm())


@pytest.fixture(scope="module", name="foreseen")
def _foreseen(one: Planned) -> Prediction:
    """By verify's code, which no patch here touches: found once for all tests."""
    return prediction(one)


def test_plan_and_recount_say_the_same(one: Planned, foreseen: Prediction) -> None:
    assert faults_in(one.document, foreseen) == []


def test_channels_solved_apart_are_found_out(foreseen: Prediction, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(told, "_joined", lambda M, common: M)
    wrong = faults_in(planned_from(on_an_arm()).document, foreseen)
    assert any("accelerometer.scale_factor, estimate" in where for where in wrong)


def off_the_axis() -> dict[str, Any]:
    """Of the accelerometers only z has its scale factor told at all temperatures: by turns upright."""
    spec: dict[str, Any] = yaml.safe_load((SHIPPED / "small_uav.yaml").read_text(encoding="utf-8"))
    rates = {"temperatures": ["-45 degC", "0 degC", "45 degC"], "repeats": 2}
    fixed = {"static": {"temperatures": ["-45 degC"], "repeats": 2}, "rates": rates}
    return spec | {"effects": [*spec["effects"], "lever_arm"], "plan": spec["plan"] | {"fixed": fixed}}


def test_channels_that_stand_apart_have_one_arm_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each with an arm of its own, a misalignment was promised with 1.1 times its variance."""
    plan = planned_from(off_the_axis())
    foreseen = prediction(plan)
    assert faults_in(plan.document, foreseen) == []
    monkeypatch.setattr(told, "shared_places", lambda group, places: [])
    monkeypatch.setattr(in_common, "shared_places", lambda group, places: [])
    wrong = faults_in(planned_from(off_the_axis()).document, foreseen)
    assert any(where.startswith("covariance, accelerometer.misalignment") for where in wrong)


def test_what_two_channels_owe_to_one_arm_is_found_out(
    foreseen: Prediction, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(in_common, "through_shared", lambda found, R, common: np.zeros((1, 1, 1, 1)))
    wrong = faults_in(planned_from(on_an_arm()).document, foreseen)
    assert any(where.startswith("covariance, accelerometer.scale_factor") for where in wrong)
