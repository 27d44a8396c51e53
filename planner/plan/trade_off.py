"""Campaign time against power-on time: the plan made again for other weights of the two."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from planner.errors import InputError, StoppedEarly
from planner.nouns.choices import Campaign
from planner.nouns.plan import TradeOffPoint
from planner.plan.costs import repeat_power_on
from planner.plan.savings import with_plan
from planner.plan.schedule_to_steps import makespan
from planner.spec.model import Spec
from planner.spec.plan_choice import Objective

# Seconds of campaign that one second of power-on is worth: from time alone to the unit's life almost alone.
# At the ends the other cost still has some weight, so that of equally good plans the better one is found.
POWER_ON_WEIGHTS = (1e-6, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0, 1e6)


@dataclass(frozen=True)
class Timed:
    """A campaign with its makespan and the power-on time of each unit, s."""

    campaign: Campaign
    time_s: float
    power_on_s: float


def trade_off(
    spec: Spec, solve: Callable[[Spec], Campaign], known: Sequence[Campaign] = ()
) -> tuple[TradeOffPoint, ...]:
    """The best campaign for every weight, shortest first; `solve` plans a spec, `known`: already planned.

    Programs price working time; with waiting and batches the campaign of another weight, or the plan itself,
    may be better. So of all of them that is taken which is best for the weight when timed. A weight whose
    plan is not found within `plan.time_limit`, or that leaves an error unobservable, is left out. Proved are
    only plans that wait for nothing and come in one batch: else the proof is of their working time.
    """
    plain = not spec.plan.shifts and spec.plan.units is None
    found = dict(_solved(spec, solve))
    every = [_timed(spec, campaign) for campaign in [*found.values(), *known]]
    points = []
    for weight in found:
        best = min(every, key=lambda timed: (timed.time_s + weight * timed.power_on_s, timed.time_s))
        points.append(
            TradeOffPoint(
                weight, round(best.time_s, 6), round(best.power_on_s, 6), _is_proved(best.campaign, plain)
            )
        )
    return tuple(points)


def _is_proved(campaign: Campaign, plain: bool) -> bool:
    return plain and campaign.proved and not campaign.added


def _solved(spec: Spec, solve: Callable[[Spec], Campaign]) -> Iterator[tuple[float, Campaign]]:
    for weight in POWER_ON_WEIGHTS:
        objective = Objective(time=1.0, power_on=weight) if weight < 1e6 else Objective(time=1e-6, power_on=1)
        try:
            yield weight, solve(with_plan(spec, minimise=objective))
        except (StoppedEarly, InputError):
            continue


def _timed(spec: Spec, campaign: Campaign) -> Timed:
    visits = campaign.visits
    power_on = sum(sum(visit.repeats) * repeat_power_on(spec, spec.tests[visit.test]) for visit in visits)
    return Timed(campaign, makespan(spec, visits), power_on)
