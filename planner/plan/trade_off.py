"""Campaign time against power-on time: the plan made again for other weights of the two."""

from __future__ import annotations

from collections.abc import Callable

from planner.errors import StoppedEarly
from planner.plan.costs import repeat_power_on
from planner.plan.savings import with_plan
from planner.plan.schedule_to_steps import makespan
from planner.records import Campaign, TradeOffPoint
from planner.spec.model import Objective, Spec

# Seconds of campaign that one second of power-on is worth: from time alone to the unit's life almost alone.
# At the ends the other cost still has some weight, so that of equally good plans the better one is found.
POWER_ON_WEIGHTS = (1e-6, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0, 1e6)


def trade_off(spec: Spec, solve: Callable[[Spec], Campaign]) -> tuple[TradeOffPoint, ...]:
    """The best campaign for every weight, shortest first; `solve` plans a spec.

    A weight whose plan is not found within `plan.time_limit` is left out.
    """
    found = []
    for weight in POWER_ON_WEIGHTS:
        objective = Objective(time=1.0, power_on=weight) if weight < 1e6 else Objective(time=1e-6, power_on=1)
        try:
            campaign = solve(with_plan(spec, minimise=objective))
        except StoppedEarly:
            continue
        power_on = sum(sum(v.repeats) * repeat_power_on(spec, spec.tests[v.test]) for v in campaign.visits)
        time = makespan(spec, campaign.visits)
        found.append(TradeOffPoint(weight, round(time, 6), round(power_on, 6), campaign.proved))
    return tuple(found)
