"""A refusal names limits that are planned, and not much wider ones than must be."""

from __future__ import annotations

import copy
import re
from dataclasses import replace

import pytest

from planner.errors import InfeasibleError
from planner.information.choose import Found, campaign_found
from planner.nouns.deadline import Deadline
from planner.spec.model import NAVIGATION_ERRORS
from tests.information import cases
from tests.information.cases import Tree

NAMED = re.compile(r"nearest limit that can be met(?: beside the others)? is ([\d.]+)")
TOGETHER = re.compile(r"requirement (\d) \(\w+\) within ([\d.]+)")

# tree of `cases`, what its requirements ask otherwise
KINDS: dict[str, tuple[int, Tree]] = {
    "rss": (0, {}),
    "percentile over the range": (7, {}),
    "percentile at the worst temperature": (17, {}),
    "any moment": (16, {"at": "any"}),
    "any moment at the worst temperature": (11, {"at": "any", "temperature": "worst"}),
    "rss and percentile that cannot be had together": (2, {}),
    "two percentiles": (15, {}),
    "two at any moment": (19, {"at": "any"}),
}


def asking(kind: str, limits: list[float] | None = None) -> Tree:
    """The tree of a kind with limits in the units of its requirements; None: such as nothing keeps."""
    seed, otherwise = KINDS[kind]
    made = copy.deepcopy(cases.tree(seed))
    for k, requirement in enumerate(made["requirement"]):
        unit = NAVIGATION_ERRORS[requirement["error"]]
        requirement |= otherwise | {"limit": f"{1e-4 if limits is None else limits[k]:.8g} {unit}"}
    return made


def found(made: Tree) -> Found:
    return campaign_found(cases.flight(made), effort="brief")


def named(made: Tree) -> list[float]:
    """The nearest limits that its refusal names."""
    with pytest.raises(InfeasibleError) as refused:
        found(made)
    limits = [float(text) for text in NAMED.findall(str(refused.value))]
    assert len(limits) == len(made["requirement"])
    return limits


SAMPLE = ["rss", "percentile at the worst temperature"]


@pytest.mark.parametrize("kind", SAMPLE)
@pytest.mark.further("kind", [kind for kind in KINDS if kind not in SAMPLE])
def test_limits_that_are_named_are_planned_and_three_percent_less_are_not(kind: str) -> None:
    limits = named(asking(kind))
    campaign = found(asking(kind, limits))
    assert all(a <= b for a, b in zip(campaign.foreseen.largest, limits, strict=True))
    named(asking(kind, [0.97 * limit for limit in limits]))


def test_a_refusal_says_that_the_time_was_over() -> None:
    flight = cases.flight(asking("rss"))
    with pytest.raises(InfeasibleError) as refused:
        campaign_found(replace(flight, deadline=Deadline(1e-6)), effort="brief")
    assert "plan.time_limit" in str(refused.value)
    with pytest.raises(InfeasibleError) as refused:
        campaign_found(flight, effort="brief")
    assert "plan.time_limit" not in str(refused.value)


def test_of_campaigns_of_thousands_of_power_ons_a_refusal_asks_few_exact_figures() -> None:
    made = asking("percentile at the worst temperature")
    made["plan"]["repeats"] = {"least": 1, "most": 1000}
    flight = cases.flight(made)
    with pytest.raises(InfeasibleError):
        campaign_found(flight, effort="brief")
    power_ons = [sum(sum(visit.repeats) for visit in visits) for visits in flight.foreseen]
    assert max(power_ons) > 2000
    assert sum(n > 2000 for n in power_ons) <= 4  # seconds each


def test_what_can_be_met_one_by_one_only_is_refused_with_limits_that_can_be_met_together() -> None:
    kind = "rss and percentile that cannot be had together"
    alone = []
    for k in range(2):
        limits = [1e-4 if i == k else 1e5 for i in range(2)]
        with pytest.raises(InfeasibleError) as refused:
            found(asking(kind, limits))
        alone.append(float(NAMED.findall(str(refused.value))[0]))
    assert all(found(asking(kind, [a if i == k else 1e5 for i in range(2)])) for k, a in enumerate(alone))
    with pytest.raises(InfeasibleError, match="one by one but not together") as refused:
        found(asking(kind, alone))
    wider = [*alone]
    for number, limit in TOGETHER.findall(str(refused.value)):
        wider[int(number) - 1] = float(limit)
    assert wider != alone
    assert all(b <= 1.1 * a for a, b in zip(alone, wider, strict=True))
    found(asking(kind, wider))
