"""A refused requirement names a limit that can be met, whatever the error, the moment and the rule."""

from __future__ import annotations

import pytest

from planner.errors import InfeasibleError
from planner.nouns.plan import Plan
from planner.pipelines.planning import exact_plan
from planner.units import from_si
from tests.specs import loaded, small, with_plan

UNITS = {"position": "m", "velocity": "m/s", "roll_pitch": "deg", "heading": "deg"}
RULES = {"worst_case": "worst_case", "rss": "rss", "percentile": {"percentile": "90 %"}}


FEW = {"repeats": {"least": 2, "most": 6}}  # what the most of them reach takes no long search


def asking(error: str, limit: str, rule: object, at: str, plan: dict | None = None) -> dict:
    flight = {"trajectory": {"name": "turn", "duration": "20 s"}, "sensitivities": "simulated"}
    wanted = {"requirement": [{"error": error, "limit": limit, "rule": rule, "at": at}]}
    return with_plan(small() | flight | wanted, **(plan or {}))


@pytest.mark.parametrize(
    ("error", "at"), [*((error, "any") for error in UNITS), ("position", "end"), ("heading", "7 s")]
)
def test_the_nearest_limit_can_be_met_and_nothing_below_it(error: str, at: str) -> None:
    nearest = refused(error, "worst_case", at)
    # the message rounds up to four digits, so a part in a million above is the hardest limit anyone may try
    met = planned(asking(error, f"{nearest * (1 + 1e-6):.12g} {UNITS[error]}", "worst_case", at))
    assert met.requirements[0].met
    assert met.proved
    with pytest.raises(InfeasibleError):
        planned(asking(error, f"{nearest * (1 - 1e-3):.12g} {UNITS[error]}", "worst_case", at))


@pytest.mark.parametrize(
    ("error", "rule", "at"),
    [("position", "rss", "end")],
)
def test_the_nearest_limit_of_a_promise_can_be_met_and_half_of_it_cannot(
    error: str, rule: str, at: str
) -> None:
    nearest = refused(error, rule, at, FEW)
    met = planned(asking(error, f"{nearest * (1 + 1e-6):.12g} {UNITS[error]}", RULES[rule], at, FEW))
    assert met.requirements[0].met
    with pytest.raises(InfeasibleError):
        planned(asking(error, f"{0.5 * nearest:.12g} {UNITS[error]}", RULES[rule], at, FEW))


def planned(spec: dict) -> Plan:
    """Its campaign alone: nothing beside it is asked for."""
    return exact_plan(loaded(spec))


def refused(error: str, rule: str, at: str, plan: dict | None = None) -> float:
    """The nearest limit, in the requirement's unit, that a refusal names."""
    with pytest.raises(InfeasibleError) as refusal:
        planned(asking(error, f"1e-9 {UNITS[error]}", RULES[rule], at, plan))
    assert refusal.value.nearest_limit is not None
    return from_si(refusal.value.nearest_limit, UNITS[error])
