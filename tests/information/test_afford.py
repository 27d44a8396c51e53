"""What so many hours can keep: against every campaign there is, and the plan of the limits it names."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from planner.errors import InfeasibleError
from planner.information.afford import Affordable, affordable
from planner.information.choose import campaign_found
from planner.information.exchange import Judge
from planner.information.model_of import Flight
from planner.information.scaled import with_limits
from planner.nouns.array import Array
from planner.plan.campaign_by_total import total
from tests.information import cases

SEEDS, FURTHER = [17], [4]
NEARLY = 1.06  # quick over exact figures: campaigns whose exact figures are asked
ROOM = 1.3  # between limits and what half of all campaigns keep
AS_GOOD = 1.01  # of the least load: the steps of the search end there


@cache
def flight(seed: int) -> Flight:
    """A small case with limits that some campaign keeps about, that may lose a record."""
    tree = cases.tree(seed)
    every = cases.Everything(cases.flight(tree))
    quick = every.quick(every.counts())
    finite = quick[np.all(np.isfinite(quick), axis=1)]
    return cases.flight(cases.limited(tree, ROOM * np.median(finite, axis=0)))


@cache
def all_of(seed: int) -> tuple[cases.Everything, Array, Array]:
    """Every campaign that determines what flies, and its time."""
    every = cases.Everything(flight(seed))
    counts = every.counts()
    counts = counts[np.all(np.isfinite(every.quick(counts)), axis=1)]
    return every, counts, every.offers.cost(counts)


@cache
def afforded(seed: int, share: float) -> tuple[float, Affordable]:
    """Seconds between the shortest and the longest campaign, and what they keep."""
    _, _, cost = all_of(seed)
    seconds = float(np.quantile(cost, share))
    return seconds, affordable(flight(seed), seconds)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.further("seed", FURTHER)
def test_no_campaign_within_the_hours_is_clearly_more_accurate(seed: int) -> None:
    seconds, found = afforded(seed, 0.3)
    every, counts, cost = all_of(seed)
    assert found.found.cost <= seconds + 1e-6
    within = counts[cost <= seconds]
    loads = (every.quick(within) / flight(seed).limits).max(axis=1)
    near = within[loads <= NEARLY * loads.min()]
    some = near[np.argsort(loads[loads <= NEARLY * loads.min()])][:12]
    best = min(float((np.array(every.exact(n).largest) / flight(seed).limits).max()) for n in some)
    assert found.load <= AS_GOOD * best


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.further("seed", FURTHER)
def test_the_plan_of_the_limits_that_are_named_fits_the_hours(seed: int) -> None:
    seconds, found = afforded(seed, 0.3)
    limits = np.array(found.limits) * (1.0 + 1e-6)
    planned = campaign_found(flight(seed).under(flight(seed).spec.model_copy(update=limited(seed, limits))))
    assert planned.cost <= seconds + 1e-6


@pytest.mark.parametrize("seed", SEEDS)
def test_the_hours_of_the_plan_keep_its_limits(seed: int) -> None:
    planned = campaign_found(flight(seed))
    assert affordable(flight(seed), planned.cost).load <= 1.0 + 1e-5


def test_hours_that_are_too_few_name_as_many_as_determine_everything() -> None:
    _, _, cost = all_of(SEEDS[0])
    with pytest.raises(InfeasibleError, match=rf"takes {cost.min() / 3600:.2f} h") as error:
        affordable(flight(SEEDS[0]), 0.5 * float(cost.min()))
    assert "give more hours" in str(error.value)


def limited(seed: int, limits: Array) -> dict[str, Any]:
    """The requirements with other limits."""
    factors = limits / flight(seed).limits
    assert np.ptp(factors) < 1e-9  # all scaled alike
    return {"requirement": with_limits(flight(seed).spec, float(factors[0])).requirement}


def test_a_family_that_decides_now_is_asked_of_those_that_were_asked_before() -> None:
    every, counts, _ = all_of(SEEDS[0])
    figures = every.promise.figures(counts)
    each = (figures / flight(SEEDS[0]).limits).max(axis=2)
    ordered = np.sort(each, axis=1)
    pick = int(np.argmax(ordered[:, -1] / ordered[:, -2]))
    names = list(every.promise.families)
    first, other = names[int(each[pick].argmin())], names[int(each[pick].argmax())]
    tight = 1.0 / np.sqrt(ordered[pick, -1] * ordered[pick, -2])  # only one family breaks it
    judge = Judge(every.promise, tightened=np.full(figures.shape[1:], tight), families=[first])
    assert judge.keep(counts[[pick]])[0]
    judge.families.append(other)  # another campaign of the same batch has shown it
    assert not judge.keeps(counts[pick])


def test_hours_are_those_of_all_loads() -> None:
    """What is planned for the limits that are named takes the hours that were given, loads included."""
    tree = cases.tree(SEEDS[0])
    bench = next(iter(tree["benches"]))
    tree["benches"][bench]["units"] = 1
    tree["plan"]["units"] = 3
    many = cases.flight(cases.limited(tree, flight(SEEDS[0]).limits))
    alone = affordable(flight(SEEDS[0]), 1e6).found
    seconds = 2.0 * total(many.spec, alone.visits) / 3.0
    found = affordable(many, seconds)
    assert total(many.spec, found.found.visits) <= seconds
    assert found.found.cost < total(many.spec, found.found.visits)  # of one load
    with pytest.raises(InfeasibleError, match="the shortest found that does takes"):
        affordable(many, 60.0)
