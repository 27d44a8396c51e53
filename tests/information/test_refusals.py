"""Specs at the edge: what is refused says why, what is planned is finite and kept."""

from __future__ import annotations

from functools import cache
from typing import Any, Literal

import numpy as np
import pytest

from planner.errors import InputError, PlannerError
from planner.information.choose import Found, campaign_found
from planner.information.exact import CLOSE
from planner.pipelines.planning import plan
from tests.information import cases
from tests.information.cases import Tree
from tests.information.test_promise import tree
from tests.specs import loaded


def small(**plan_of: Any) -> Tree:
    """Two tests on one table, four candidate temperatures, one requirement that is easily met."""
    made = tree("level")
    made["requirement"] = [{"error": "horizontal", "rule": {"percentile": "95 %"}, "limit": "2000 m"}]
    made["plan"]["temperatures"]["step"] = "20 K"
    made["plan"]["repeats"] = {"least": 1, "most": 3}
    made["plan"] |= plan_of
    return made


def found(made: Tree, effort: Literal["brief", "usual"] = "usual") -> Found:
    return campaign_found(cases.flight(made), effort=effort)


@cache
def brief() -> Found:
    """The campaign of `small` as it stands, found with little effort."""
    return found(small(), "brief")


def kept(campaign: Found, bounded: bool = True) -> None:
    figure, limit = campaign.foreseen.largest[0], campaign.judge.promise.asked[0].limit
    assert 0.0 < figure <= limit * (1.0 + 1e-6)
    assert not bounded or 0.0 < campaign.bound <= campaign.cost + 1e-6


@pytest.mark.parametrize(
    "temperatures",
    [
        {"range": ["19 degC", "21 degC"]},
        {"range": ["-20 degC", "40 degC"], "room": "50 degC", "step": "100 K"},
    ],
)
@pytest.mark.further("temperatures", [{"range": ["30 degC", "70 degC"], "step": "20 K"}])
def test_ranges_at_the_edge(temperatures: Tree) -> None:
    made = small(temperatures=temperatures)
    made["requirement"][0]["limit"] = "20000 m"
    campaign = found(made, "brief")
    kept(campaign, bounded=False)
    low, high = (float(t.split()[0]) for t in temperatures["range"])
    assert all(low <= t <= high for v in campaign.visits for t in v.temperatures_degc)
    if high - low < 3.0:
        assert all(len(v.temperatures_degc) == 1 for v in campaign.visits)


@pytest.mark.parametrize("fixed", [{"static": {"temperatures": "room"}, "rates": {"temperatures": "room"}}])
def test_all_in_the_room(fixed: Tree) -> None:
    made = small(fixed=fixed)
    made["requirement"][0]["limit"] = "20000 m"
    campaign = found(made)
    kept(campaign)
    assert {t for v in campaign.visits for t in v.temperatures_degc} == {20.0}
    assert not [s for s in campaign.timeline if s.action in ("soak", "ramp")]


def test_zero_storage_and_no_curve() -> None:
    made = small()
    for sensor in ("gyro", "accelerometer"):
        for budget in made["unit"][sensor].values():
            budget.pop("temperature_residual", None)
            if "storage" in budget:
                budget["storage"] = f"0 {budget['storage'].split()[1]}"
    kept(found(made))


def test_least_above_most_is_refused() -> None:
    with pytest.raises(PlannerError, match=r"least|most"):
        loaded(small(repeats={"least": 3, "most": 2}))


def test_nothing_that_tells_an_error_that_matters() -> None:
    made = small()
    del made["tests"]["rates"]
    made["tests"]["static"] |= {"motions": 1, "calibrates": ["gyro.bias", "accelerometer.bias"]}
    with pytest.raises(PlannerError, match=r"scale_factor|g_sensitivity"):
        plan(loaded(made), lambda message: None)


def test_benches_of_no_kind_are_refused_and_not_an_internal_error() -> None:
    """Nobody knows what their records tell; of one beside others a test is left out, as `check` warns."""
    made = small()
    (name,) = made["benches"]
    made["benches"] = {"table": made["benches"][name]}
    made["tests"] = {test: own | {"bench": "table"} for test, own in made["tests"].items()}
    with pytest.raises(InputError, match=r"benches\.table has none; add 'kind:', one of .*rate_table"):
        found(made, "brief")
    made["benches"]["table"] |= {"kind": "rate_table"}
    kept(found(made, "brief"), bounded=False)


def test_several_benches_with_chambers() -> None:
    made = small()
    made["benches"]["second"] = made["benches"]["rate_table"] | {"kind": "rate_table"}
    made["tests"]["rates"]["bench"] = "second"
    kept(found(made, "brief"), bounded=False)


def test_units_and_shifts() -> None:
    """The campaign of one unit is the same; hours of work are those of its batch."""
    shifts = {"days": ["mon", "tue"], "from": "08:00", "to": "17:00"}
    made, alone = small(units=9, shifts=shifts), brief()
    made["benches"]["rate_table"] |= {"units": 4, "attended": False}
    kept(campaign := found(made, "brief"), bounded=False)
    assert campaign.visits == alone.visits
    assert campaign.cost == pytest.approx(alone.cost)


def test_a_plan_by_hand_is_foreseen_and_not_changed() -> None:
    made = small(
        fixed={
            "static": {"temperatures": ["-20 degC", "40 degC"], "repeats": 2},
            "rates": {"temperatures": 1, "repeats": 1},
        }
    )
    made["requirement"][0]["limit"] = "1 m"
    campaign = found(made)
    assert campaign.foreseen.largest[0] > 1.0
    assert [(v.test, v.temperatures_degc, v.repeats) for v in campaign.visits] == [
        ("static", (-20.0, 40.0), (2, 2)),
        ("rates", (10.0,), (1,)),
    ]


def test_one_record_among_many_is_no_node() -> None:
    """One-record repeats at two temperatures: the fit has one node, and the promise is that of one node."""
    made = small()
    made["effects"] = ["bias", "bias_temperature"]
    made["unit"]["gyro"] = {"bias": made["unit"]["gyro"]["bias"]}
    made["unit"]["accelerometer"] = {"bias": made["unit"]["accelerometer"]["bias"]}
    faces = ["gyro.bias", "accelerometer.bias"]
    static = made["tests"]["static"] | {"calibrates": faces}
    made["tests"] = {"static": static, "drift": static | {"motions": 1}}
    every = cases.Everything(cases.flight(made))
    one, two = (
        cases.counts_of(
            every.offers, cases.visits(("static", (20.0,), (2,)), ("drift", (-20.0, 40.0), (n, n)))
        )
        for n in (1, 2)
    )
    (quick,), (more,) = every.quick(one[None]), every.quick(two[None])
    assert quick > 1.3 * more
    found = every.exact(one)
    np.testing.assert_allclose(quick, found.promise.figures(found.counts)[0].max(axis=0), rtol=0.01)


@pytest.mark.parametrize("effect", ["ageing"])
@pytest.mark.further("effect", ["bias_step"])
def test_what_only_days_tell_is_named_and_may_stay_whole(effect: str) -> None:
    """A campaign is planned as of one day; left out of `effects` the same budget stays whole."""
    made = small()
    unit = {"ageing": "deg/s/day", "bias_step": "deg/s"}[effect]
    made["unit"]["gyro"][effect] = {"systematic": f"1e-6 {unit}"}
    with_it = made | {"effects": [*made["effects"], effect]}
    with pytest.raises(
        PlannerError, match=rf"tells gyro\.{effect} \(x, y, z\); .* days .* take {effect} out of 'effects'"
    ):
        found(with_it, effort="brief")
    kept(found(made), bounded=False)


def test_what_quick_figures_take_for_harder_is_asked_exactly() -> None:
    """Without a node beside another one kinks leave a fifth more by quick figures, and less exactly."""
    made = cases.tree(2259)
    every = cases.Everything(cases.flight(made))
    one = np.array([2.0, 2.0, 2.0, 2.0, 0.0, 2.0])
    limits = (1.0 + 1.2 * CLOSE) * np.array(every.exact(one).largest)  # closer, and more flights are drawn
    assert np.all(every.quick(one[None]) > every.quick(np.full((1, 6), 2.0)))
    assert np.all(limits < every.exact(np.full(6, 2.0)).largest)
    found = campaign_found(cases.flight(cases.limited(made, limits)))
    assert np.all(found.foreseen.largest <= limits)
