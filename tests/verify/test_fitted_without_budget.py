"""Effects that are declared, and so fitted, but not budgeted: what the fit makes of noise flies too."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from planner import catalog
from planner.information import model_of
from planner.nouns.conditions import Conditions
from planner.response import Acting, response, true_input
from tests.verify.plans import Planned, planned_from
from tests.verify.test_recount_promise import by_hand, faults, faults_in, prediction


def unbudgeted() -> dict[str, Any]:
    """Accelerometers that are fitted at 1 g for a cubic that they are not said to have, and fly to 80 g."""
    spec = by_hand()
    wide = [{"error": "position", "limit": "900 km", "rule": "rss"}]
    effects = [*spec["effects"], "misalignment", "scale_factor_nonlinearity"]
    tests = {name: dict(test) for name, test in spec["tests"].items()}
    tests["rates"]["motions"] = 24
    return spec | {"requirement": wide, "trajectory": "small_uav_2", "effects": effects, "tests": tests}


@pytest.fixture(scope="module", name="one")
def _one() -> Planned:
    return planned_from(unbudgeted())


def test_plan_and_recount_say_the_same(one: Planned) -> None:
    assert faults(one) == []


def test_a_planner_that_flies_budgets_only_is_found_out(
    one: Planned, monkeypatch: pytest.MonkeyPatch
) -> None:
    foreseen = prediction(one)
    monkeypatch.setattr(model_of, "_fitted", lambda spec: ())
    assert any("families" in where for where in faults_in(planned_from(unbudgeted()).document, foreseen))


def test_an_error_without_a_budget_has_no_allowance(one: Planned) -> None:
    assert "accelerometer.scale_factor_nonlinearity" not in one.document["allowances"]
    assert {term["error"] for term in one.document["covariance"]["terms"]} <= set(one.document["allowances"])


def turning(rate: np.ndarray) -> Conditions:
    n = len(rate)
    none = np.zeros(n)
    return Conditions(rate, np.zeros((n, 3)), none, none, none, none)


@pytest.mark.parametrize("name", ["scale_factor_polynomial", "scale_factor_nonlinearity"])
@pytest.mark.parametrize("size", [0.01, -0.7, 30.0])
def test_readings_beyond_the_range_give_a_finite_input(name: str, size: float) -> None:
    """Small bends are undone everywhere; one that folds back has no inverse, and must not become nan."""
    effect = catalog.effects()[name]
    rate = np.radians(np.linspace(-900.0, 900.0, 61))[:, None] * np.array([1.0, 0.4, 0.1])
    c = turning(rate)
    acting = [Acting(effect, np.full(len(effect.terms("gyro")), size))]
    y = response("gyro", c, acting)
    found = true_input("gyro", y, replace(c, rate=y), acting)
    assert np.all(np.isfinite(found))
    assert np.all(np.abs(found) <= 2.0 * np.abs(y).max(axis=1, keepdims=True) + 1e-12)
    if size == 0.01:
        np.testing.assert_allclose(found, rate, atol=1e-12)


def test_a_polynomial_keeps_its_slope_beyond_the_range() -> None:
    """κ at 500 deg/s and at 800 are the same: c1 x + c2 x² at x = 1 − 1/500, in two lines of its own."""
    effect = catalog.effects()["scale_factor_polynomial"]
    values = np.array([t.name == "x +1" for t in effect.terms("gyro")]) * 0.003
    values += np.array([t.name == "x -2" for t in effect.terms("gyro")]) * -0.002
    rate = np.radians([[0.5, 0, 0], [250, 0, 0], [501, 0, 0], [800, 0, 0], [-250, 0, 0], [-800.0, 0, 0]])
    kappa = (effect.regressors("gyro", turning(rate)) @ values)[:, 0] / rate[:, 0]
    expected = [0.0, 0.003 * 0.498, 0.003, 0.003, -0.002 * 0.498**2, -0.002]
    np.testing.assert_allclose(kappa, expected, rtol=1e-9, atol=1e-15)
