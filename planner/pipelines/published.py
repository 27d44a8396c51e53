"""The flow of a plan by the published method: allowances → repeats → schedule → plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from planner import __version__
from planner.errors import PlannerError
from planner.information.choose import campaign_found
from planner.information.model_of import flight_of
from planner.nouns.choices import Campaign
from planner.nouns.deadline import BESIDE, GENETIC, Deadline
from planner.nouns.plan import Plan, TradeOffPoint
from planner.nouns.progress import Progress
from planner.pipelines.allowing import region_or_why_not
from planner.pipelines.navigation import Navigation, task_of
from planner.pipelines.planned import Answered, Planned, remarked
from planner.pipelines.remarks import cut_short
from planner.plan.budget import common_rule
from planner.plan.by_hand import is_hand_made
from planner.plan.campaign_by_total import by_total
from planner.plan.campaign_to_plan import plan_of
from planner.plan.genetic_campaign import genetic_plan, told_above
from planner.plan.genetic_settings import genetic_settings
from planner.plan.observable_campaign import observable_campaign
from planner.plan.plan_to_schedule_figures import with_schedule_figures
from planner.plan.repeats_to_schedule import campaign
from planner.plan.schedule_to_steps import planned_tests, steps
from planner.plan.task import Task, within_seconds
from planner.plan.trade_off import trade_off
from planner.spec.load import LoadedSpec
from planner.spec.model import PercentileRule, Spec

OF_PROOF = 0.8  # of the time that is left, for the published program: it begins with a quarter more
SURE = 0.95  # of the flights, for what a limit costs as a percentile


def published(
    loaded: LoadedSpec, navigation: Navigation, progress: Progress, deadline: Deadline, answered: Answered
) -> Planned:
    """The published plan with the region of allowed errors and the genetic campaign beside it."""
    spec = loaded.spec
    task = task_of(spec, navigation)
    progress("choosing temperatures and repeats")
    in_hours = spec.plan.minimise == "time"  # the cost is seconds then, and nothing else
    told = deadline.report_bounded if in_hours else None
    exact = campaign(within_seconds(task, OF_PROOF * deadline.left), told)
    progress("the same with waiting and batches in sight")
    chosen = observable_campaign(task, by_total(within_seconds(task, deadline.left), exact))
    said, notes = remarked(loaded, navigation), list[str]()
    if not deadline.over(BESIDE, "what the limits cost as a percentile"):
        notes += _as_percentile(loaded, navigation, deadline)
    made = _timed(loaded, navigation, task, chosen, [*said, *notes])
    curve: tuple[TradeOffPoint, ...] = ()
    if spec.plan.trade_off and not is_hand_made(spec):
        progress("trade-off of campaign time and power-on time")
        curve = trade_off(spec, lambda other: _observable(other, navigation), [chosen])
    made = with_schedule_figures(made, spec, chosen, curve)
    answered(Planned(cut_short(made, deadline), navigation, None))
    if is_hand_made(spec):
        return Planned(cut_short(made, deadline), navigation, None)
    late = deadline.stops(GENETIC, "the region of allowed errors")
    allowed, why_not = region_or_why_not(spec, task, navigation, progress, late)
    progress("genetic algorithm beside the exact campaign")
    late = deadline.stops(BESIDE, "the genetic campaign")
    above = told_above(exact.objective, spec.plan.genetic.generations, progress)
    rule = common_rule(navigation.constraints)
    genetic = genetic_plan(task, exact, rule, genetic_settings(spec, late), spec.plan.seed, above)
    notes = [*said, *why_not, *made.notes[len(said) :]]
    return Planned(
        cut_short(replace(made, genetic=genetic, notes=tuple(notes)), deadline), navigation, allowed
    )


def exactly_published(loaded: LoadedSpec, navigation: Navigation, progress: Progress) -> Plan:
    """The campaign and its steps alone."""
    progress("choosing temperatures and repeats")
    task = task_of(loaded.spec, navigation)
    chosen = observable_campaign(task, by_total(task, campaign(task)))
    return with_schedule_figures(_timed(loaded, navigation, task, chosen), loaded.spec, chosen)


def _as_percentile(loaded: LoadedSpec, navigation: Navigation, deadline: Deadline) -> list[str]:
    """What the limits of a plan by sums of moduli cost as percentiles of what is flown."""
    spec = loaded.spec
    if navigation.flight is None or is_hand_made(spec):
        return []
    rule = PercentileRule.model_validate({"percentile": f"{100 * SURE:g} %"})
    probable = [
        r.model_copy(update={"rule": rule}) if r.rule == "worst_case" else r for r in spec.requirement
    ]
    other = spec.model_copy(update={"requirement": tuple(probable)})
    if other == spec or other.planned_by != "information":
        return []
    try:
        found = campaign_found(flight_of(other, navigation.flight, Deadline(deadline.left)), effort="brief")
    except PlannerError:
        return []
    return [
        f"requirement: worst_case adds moduli as if every error were at its limit at once; for {SURE:.0%} of "
        f"all flights within the same limits {found.cost / 3600:.2f} h suffice "
        f"(rule: {{percentile: {100 * SURE:g} %}})"
    ]


def _observable(spec: Spec, navigation: Navigation) -> Campaign:
    """The campaign of another choice of weights, by working time."""
    task = task_of(spec, navigation)
    return observable_campaign(task, campaign(task))


def _timed(
    loaded: LoadedSpec,
    navigation: Navigation,
    task: Task,
    chosen: Campaign,
    notes: Sequence[str] = (),
) -> Plan:
    """The campaign with its steps on the benches."""
    timeline = steps(loaded.spec, chosen)
    return plan_of(
        task,
        navigation.constraints,
        chosen,
        timeline,
        planned_tests(loaded.spec, chosen.visits, timeline),
        version=__version__,
        sha256=loaded.sha256,
        genetic=None,
        notes=notes,
    )
