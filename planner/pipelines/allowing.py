"""The flow of the allowed sensor errors: spec → sensitivities → region, genetic and exact."""

from __future__ import annotations

from collections.abc import Callable

from planner.errors import InfeasibleError
from planner.information.allowed import extreme_sizes, in_sizes
from planner.information.model_of import flight_of
from planner.nouns.allowances import AllowedErrors
from planner.nouns.deadline import never
from planner.nouns.progress import Progress
from planner.pipelines.navigation import Navigation, navigate, task_of
from planner.plan.budget import common_rule
from planner.plan.genetic_settings import genetic_settings
from planner.plan.observable_campaign import refuse_what_no_campaign_observes
from planner.plan.sensitivity_to_allowance import allowed_errors
from planner.plan.task import Task, extreme_allowances
from planner.solvers.one_thread import one_thread
from planner.spec.load import LoadedSpec
from planner.spec.model import Spec


@one_thread()
def allow(
    loaded: LoadedSpec, progress: Progress, stop: Callable[[], bool] = never
) -> tuple[Navigation, AllowedErrors]:
    """Spec → the region of allowed sensor errors: genetic algorithm and exact optimum.

    stop: asked for every generation; once it says yes, the one that is there is the last
    """
    navigation = navigate(loaded, progress)
    if loaded.spec.planned_by == "information":
        return navigation, _in_flight(loaded.spec, navigation, progress, stop)
    task = task_of(loaded.spec, navigation)
    return navigation, region(loaded.spec, task, navigation, progress, stop)


def region(
    spec: Spec, task: Task, navigation: Navigation, progress: Progress, late: Callable[[], bool] = never
) -> AllowedErrors:
    """The region of what errors may be by K's sums, between the most records and the fewest."""
    progress("allowed sensor errors: genetic algorithm and exact optimum")
    smallest, largest = extreme_allowances(task, common_rule(navigation.constraints))
    return allowed_errors(
        navigation.constraints,
        [a.error for a in smallest],
        {a.error: a.unit for a in smallest},
        {a.error: a.allowed for a in smallest},
        {a.error: a.allowed for a in largest},
        genetic_settings(spec, late),
        spec.plan.seed,
    )


def _in_flight(
    spec: Spec, navigation: Navigation, progress: Progress, late: Callable[[], bool]
) -> AllowedErrors:
    """The region of what errors may be in flight, between the most records and none."""
    refuse_what_no_campaign_observes(spec)
    assert navigation.flight is not None  # sensitivities are simulated
    progress("what the bench can reach")
    smallest, largest = extreme_sizes(flight_of(spec, navigation.flight))
    progress("allowed sensor errors: genetic algorithm and exact optimum")
    units = {model.name: model.unit for model in navigation.models}
    constraints = in_sizes(navigation.constraints, spec)
    return allowed_errors(
        constraints, [*smallest], units, smallest, largest, genetic_settings(spec, late), spec.plan.seed
    )


def region_or_why_not(
    spec: Spec, task: Task, navigation: Navigation, progress: Progress, late: Callable[[], bool]
) -> tuple[AllowedErrors | None, list[str]]:
    """The allowed region beside a campaign that exists; with mixed rules there may be none.

    The region knows one size per error, so with mixed rules it must take the sum of the parts, which a
    percentile or rss requirement does not ask for.
    """
    try:
        return region(spec, task, navigation, progress, late), []
    except InfeasibleError:
        if len({constraint.rule for constraint in navigation.constraints}) == 1:
            raise
        return None, [
            "no region of allowed errors: the requirements mix rules, and sums of parts exceed them"
        ]
