"""The genetic algorithm's campaigns counted again: a change of any figure, or of what a point is made of."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import pytest

from planner.verify.experiment import Experiment, experiment
from planner.verify.prediction import DrawnCurves
from planner.verify.recount_front import check_campaigns
from tests.verify.plans import Planned, flown, planned_from

Kept = tuple[Planned, Experiment, DrawnCurves]


def small_front() -> dict[str, Any]:
    """Two sensors by information; what is made by hand leaves the front one point and few curves to draw."""
    spec = flown(name="front")
    for sensor in spec["unit"].values():
        sensor["bias"]["temperature_residual"] |= {"curve": "kink"}
    wanted = {"error": "horizontal", "limit": "900 m", "rule": {"percentile": "95 %"}}
    fixed = {
        "static": {"temperatures": ["-50 degC", "0 degC", "50 degC"], "repeats": 2},
        "rates": {"temperatures": ["0 degC"], "repeats": 3},
    }
    return spec | {
        "requirement": [wanted],
        "plan": spec["plan"] | {"method": "information", "fixed": fixed, "quantile": "student"},
    }


@pytest.fixture(scope="module", name="kept")
def _kept() -> Kept:
    one = planned_from(small_front(), with_genetic=True)
    e = experiment(one.document, one.loaded.spec, one.trajectory, seed=1)
    return one, e, DrawnCurves(e.spec)


def faults(kept: Kept, change: Callable[[dict[str, Any]], object]) -> set[str]:
    one, e, curves = kept
    document = copy.deepcopy(one.document)
    change(document["genetic"])
    return {fault.where for fault in check_campaigns(document, e, curves).faults}


def test_the_front_as_planner_writes_it_is_right_and_is_of_the_plan(kept: Kept) -> None:
    genetic = kept[0].document["genetic"]
    assert len(genetic["front"]) == len(genetic["campaigns"]) == 1
    assert genetic["front"][0]["time_s"] == pytest.approx(kept[0].document["time_s"])
    assert genetic["front"][0]["power_on_s"] == pytest.approx(kept[0].document["power_on_s"])
    assert genetic["front"][0]["0"] == pytest.approx(kept[0].document["requirements"][0]["achieved"])
    assert faults(kept, lambda genetic: None) == set()


@pytest.mark.parametrize(
    ("change", "where"),
    [
        (lambda g: g["front"][0].update(time_s=g["front"][0]["time_s"] - 1.0), "time_s"),
        (lambda g: g["front"][0].update(power_on_s=g["front"][0]["power_on_s"] + 1.0), "power_on_s"),
        (lambda g: g["front"][0].update({"0": 0.95 * g["front"][0]["0"]}), "requirement 0"),
        (lambda g: g["front"][0].update({"0": 1.05 * g["front"][0]["0"]}), "requirement 0"),
        (lambda g: g["front"][0].pop("0"), "requirement 0"),
        (lambda g: _visit(g, "rates")["repeats"].__setitem__(0, 4), "time_s"),
        (lambda g: _visit(g, "static")["temperatures_degc"].__setitem__(2, 0.5), "requirement 0"),
        (lambda g: _visit(g, "static").update(test="steps"), ""),
        (lambda g: _visit(g, "static")["repeats"].pop(), ""),
        (lambda g: g["campaigns"].pop(), "campaigns"),
    ],
)
def test_any_change_of_a_point_or_of_its_campaign_is_seen(
    kept: Kept, change: Callable[[dict[str, Any]], object], where: str
) -> None:
    place = {"": "genetic, front 0", "campaigns": "genetic, campaigns"}.get(
        where, f"genetic, front 0, {where}"
    )
    assert place in faults(kept, change)


def test_few_temperatures_may_differ_by_what_their_draws_do_and_no_more(kept: Kept) -> None:
    """A fault of 10 % is seen in a campaign of two temperatures, too."""
    one, e, curves = kept
    document = copy.deepcopy(one.document)
    genetic = document["genetic"]
    for visit in genetic["campaigns"][0]:
        visit["temperatures_degc"], visit["repeats"] = visit["temperatures_degc"][:2], visit["repeats"][:2]
    place = "genetic, front 0, requirement 0"
    (said,) = (f.what for f in check_campaigns(document, e, curves).faults if f.where == place)
    right = float(said.split()[-1])
    for factor, seen in ((1.0, False), (1.04, False), (0.96, False), (1.1, True), (0.9, True)):
        genetic["front"][0]["0"] = factor * right
        assert (place in {f.where for f in check_campaigns(document, e, curves).faults}) == seen


def _visit(genetic: dict[str, Any], test: str) -> dict[str, Any]:
    return next(visit for visit in genetic["campaigns"][0] if visit["test"] == test)
