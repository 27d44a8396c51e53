"""A plan of single visits can lose any one record: each is left out, and verify's own estimator is asked."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import pytest

from planner.errors import InputError
from planner.verify.experiment import experiment
from planner.verify.weak import weak_coefficients
from tests.verify.plans import Planned, flown, planned_from


def once(**changes: Any) -> dict[str, Any]:
    """Visits may be single, and the limit is so wide that they are."""
    spec = flown(name="once", **changes)
    wide = {"error": "horizontal", "limit": "480 m", "rule": "rss"}
    return spec | {"requirement": [wide], "plan": spec["plan"] | {"repeats": {"least": 1, "most": 3}}}


def uncalibrated() -> dict[str, Any]:
    """The same, the gyros' scale factor left as it is."""
    spec = once(effects=["bias", "bias_temperature"])
    return spec | {"tests": {"static": spec["tests"]["static"]}}


def without_each_record(one: Planned) -> Iterator[dict[str, Any]]:
    records = [i for i, step in enumerate(one.document["steps"]) if step["action"] == "record"]
    for i in records:
        document = copy.deepcopy(one.document)
        del document["steps"][i]
        yield document


def lost(one: Planned) -> list[str]:
    """What no record tells any more when the worst one is lost."""
    return max((untold(one, document) for document in without_each_record(one)), key=len)


def untold(one: Planned, document: dict[str, Any]) -> list[str]:
    """What verify's own estimator does not tell by a plan's records; a word if these are too few to fit."""
    try:
        e = experiment(document, one.loaded.spec, one.trajectory, seed=1)
    except InputError as error:
        return [str(error)]
    return [w.error for w in weak_coefficients(e) if "no record" in w.why]


@pytest.mark.parametrize("tree", [once, uncalibrated])
def test_no_record_is_the_only_one_that_tells_something(tree: Any) -> None:
    one = planned_from(tree())
    assert min(n for test in one.document["tests"] for n in test["repeats"]) == 1
    assert lost(one) == []


@pytest.mark.parametrize("redundancy", [0, 1])
def test_a_turn_about_each_axis_is_made_twice_where_none_may_be_lost(redundancy: int) -> None:
    """Three turns once tell three scale factors, each by one record."""
    tree, turn = once(), "200 deg/s"
    about = [{"position_1": "90 deg", "rate_2": turn}, {"rate_1": turn}, {"rate_2": turn}]
    tree["tests"]["rates"]["motions"] = about
    one = planned_from(tree | {"plan": tree["plan"] | {"redundancy": redundancy}})
    assert (lost(one) == []) == (redundancy == 1)
