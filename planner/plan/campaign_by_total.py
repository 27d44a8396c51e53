"""The campaign with waiting and batches in sight: work chosen for other prices and timed, the shortest kept.

The integer program chooses by the working time of one batch, W(x) = Σ_m p_m(x), p_m the seconds on bench m.
What counts is the total V(x) = of_time · T(x) + of_power · P(x), T the makespan with waiting for shifts and
with several loads. T is no sum over resources, but for any shares λ_m >= 0, Σ λ_m = 1,

    T(x) >= Σ_m p_m + max_m (b_m − 1) p_m >= Σ_m (1 + (b_m − 1) λ_m) p_m(x),   b_m loads of bench m at least,

and the right-hand side is: the same program with the prices of bench m multiplied. Its optimum is a candidate
for the shortest total and its proved bound a bound of V for every choice. Further candidates come from dearer
work of people: in shifts an hour of theirs is worth several. Candidates are timed, not priced, so whatever
their prices, the one that is kept is the best of those that were looked at; only prices by λ give bounds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.nouns.array import Array
from planner.nouns.choices import Campaign, TestVisits
from planner.plan.by_hand import is_hand_made
from planner.plan.costs import Resource, price, repeat_power_on, weights_of
from planner.plan.percentile_cuts import objection
from planner.plan.repeats_to_schedule import campaign_of, visits_of
from planner.plan.savings import with_plan
from planner.plan.schedule_to_steps import makespan
from planner.plan.task import Task
from planner.solvers.integer import Choice, solve
from planner.spec.attendance import is_attended
from planner.spec.model import Spec
from planner.spec.plan_choice import Objective

# What an hour of people's is worth: one, and up to more than the share of a week that one shift a day leaves.
PEOPLE_WORTH = (1.0, 1.5, 2.5, 5.0)
# Of the time for the proof, what each of the dozen further programs may take.
SHARE_OF_TIME = 1 / 12
SAME_S = 1e-3


@dataclass(frozen=True)
class Prices:
    """Prices (K,) of the resources; is_bound: whether their optimum bounds the total of every campaign."""

    prices: Array
    is_bound: bool


def by_total(task: Task, first: Campaign) -> Campaign:
    """The campaign of least total found, with a bound of the total that holds for every campaign.

    first: the best by working time. It is returned as it is when nothing waits and there is one batch, when
    it was not proved in time, or when the plan is made by hand.
    """
    spec = task.spec
    if is_hand_made(spec) or not first.proved or not (spec.plan.shifts or spec.plan.units is not None):
        return first
    best, least, bound = first, total(spec, first.visits), first.bound
    for prices in prices_by_total(spec, task.tariff.resources):
        choice = _solved(task, prices.prices)
        if choice is None:
            continue
        bound = max(bound, choice.bound) if prices.is_bound else bound
        found = total(spec, visits_of(task, choice.rows))
        if found < least - SAME_S:
            cost = task.problem.cost(choice.rows)
            candidate = campaign_of(task, replace(choice, cost=cost, bound=first.bound, proved=True))
            best, least = replace(candidate, by_total=True), found
    return replace(best, total_bound=min(bound, least))


def total(spec: Spec, visits: Sequence[TestVisits]) -> float:
    """Weighted seconds of a campaign, with waiting and batches."""
    of_time, of_power = weights_of(spec)
    power = sum(sum(visit.repeats) * repeat_power_on(spec, spec.tests[visit.test]) for visit in visits)
    return of_time * makespan(spec, visits) + of_power * power


def least_loads(spec: Spec, bench: str) -> int:
    """Loads that a bench has at least one after another, if every unit is on it or one of its kind."""
    b = spec.benches[bench]
    return 1 if spec.plan.units is None else math.ceil(math.ceil(spec.plan.units / b.units) / b.count)


def used_benches(spec: Spec) -> list[str]:
    """Benches that have tests, in the order of the spec."""
    names = {test.bench for test in spec.tests.values()}
    return [name for name in spec.benches if name in names]


def _solved(task: Task, prices: Array) -> Choice | None:
    limit = task.spec.plan.time_limit * SHARE_OF_TIME
    try:
        return solve(
            replace(task.problem, prices=prices), check=lambda rows: objection(task, rows), time_limit=limit
        )
    except TimeoutError:
        return None


def prices_by_total(spec: Spec, resources: Sequence[Resource]) -> Iterator[Prices]:
    """Every combination of shares and worths, the plain one left out: that was the first campaign."""
    of_time, of_power = weights_of(spec)
    seconds = np.array([price(with_plan(spec, minimise=Objective(time=1, power_on=0)), r) for r in resources])
    powered = np.array([price(with_plan(spec, minimise=Objective(time=0, power_on=1)), r) for r in resources])
    people = np.array([bool(r.test) and is_attended(spec, r.test) for r in resources])
    worths = PEOPLE_WORTH if spec.plan.shifts and people.any() else PEOPLE_WORTH[:1]
    names = used_benches(spec)
    loads = {name: least_loads(spec, name) for name in names}
    several = max(loads.values(), default=1) > 1
    for shares in _shares([*loads.values()]) if several else [(0.0,) * len(names)]:
        bottleneck = dict(zip(names, shares, strict=True))
        passes = np.array(
            [1.0 + (loads.get(r.bench, 1) - 1) * bottleneck.get(r.bench, 0.0) for r in resources]
        )
        for worth in worths:
            if several or worth != 1.0:
                weighted = of_time * passes * np.where(people, worth, 1.0) * seconds + of_power * powered
                yield Prices(weighted, worth == 1.0)


def _shares(loads: Sequence[int]) -> list[tuple[float, ...]]:
    """Who is the bottleneck: each bench alone, all alike, what lies between two, all by what they can carry.

    By 1 / (loads − 1) work costs the same on every bench: whichever is left out, the bound stays.
    """
    count = len(loads)
    if count == 1:
        return [(1.0,)]
    alone = [tuple(float(i == j) for i in range(count)) for j in range(count)]
    between: list[tuple[float, ...]] = [(0.75, 0.25), (0.25, 0.75)] if count == 2 else []
    if min(loads) > 1 < len(set(loads)):
        carried = np.array([1.0 / (n - 1) for n in loads])
        between.append(tuple(map(float, carried / carried.sum())))
    return [*alone, (1.0 / count,) * count, *between]
