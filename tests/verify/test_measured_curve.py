"""A curve without a name of its own, as `update` declares it: verify counts it, draws it and flies it."""

from __future__ import annotations

import copy
from functools import cache
from typing import Any

import pytest

from planner.pipelines.promise import FlightOptions, verify
from planner.verify.verification import Verification
from tests.specs import loaded
from tests.verify.plans import Planned, flown, planned_from, sealed_again

CURVE = "curve_gyro_y_over_orientation"
SIZE = "0.05 deg/s"  # of each way up: the level minute makes a kilometre of it


def spec(curve: bool = True) -> dict[str, Any]:
    """The level minute as a percentile, planned by hand; gyro y reads otherwise on every face."""
    plain = flown(name="curved")
    for sensor in plain["unit"].values():
        sensor["bias"]["temperature_residual"] |= {"curve": "kink"}
    static = {"temperatures": ["-50 degC", "0 degC", "50 degC"], "repeats": 2}
    plan = plain["plan"] | {"fixed": {"static": static, "rates": {"temperatures": ["0 degC"], "repeats": 2}}}
    plain |= {
        "requirement": [{"error": "position", "limit": "480 m", "rule": {"percentile": "95 %"}}],
        "plan": plan | {"method": "information"},
    }
    if curve:
        plain["unit"]["gyro"][CURVE] = {"systematic": SIZE}
        plain["effects"] = [*plain["effects"], CURVE]
        plain["tests"]["static"]["calibrates"] = [*plain["tests"]["static"]["calibrates"], f"gyro.{CURVE}"]
    return plain


@cache
def plan(curve: bool) -> Planned:
    return planned_from(spec(curve))


def verified(document: dict[str, Any], flights: int, made_for: Planned | None = None) -> Verification:
    options = FlightOptions(flights=flights, through_files=0 if made_for else 1)
    return verify(
        plan(True).loaded, document, options, lambda _: None, None if made_for is None else made_for.loaded
    )


def test_the_recount_counts_a_curve_and_its_flights_keep_the_promise() -> None:
    found = verified(plan(True).document, 150)
    assert found.recount.ok, found.recount.faults
    (one,) = found.outcomes
    assert one.at_promise == pytest.approx(one.achieved, rel=0.2)  # 95 % point of 150 flights: ± 15 %
    assert found.files is not None


def test_units_with_the_curve_fly_worse_where_nobody_calibrates_it() -> None:
    found = verified(plan(False).document, 60, made_for=plan(False))
    (one,) = found.outcomes
    assert one.at_promise > 1.5 * one.achieved


@pytest.mark.parametrize("key", ["allowances", "sensitivities"])
def test_a_figure_of_the_curve_that_is_edited_is_found(key: str) -> None:
    document = copy.deepcopy(plan(True).document)
    if key == "allowances":
        document[key][f"gyro.{CURVE}"]["parts"]["estimate"] *= 3.0
    else:
        felt = [s for s in document[key] if s["error"] == f"gyro.{CURVE}"]
        max(felt, key=lambda s: abs(s["value"]))["value"] *= 2.0
    found = verified(sealed_again(document), 0)
    assert any(CURVE in fault.where or key in fault.where for fault in found.recount.faults)


def test_the_spec_takes_the_curve_by_its_name() -> None:
    assert CURVE in loaded(spec()).spec.effects
