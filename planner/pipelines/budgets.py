"""What spreads beyond their budgets cost: metres of a flight, hours of a campaign where a plan is given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from planner.diagnose.budget_to_navigation import in_flight, with_noise
from planner.diagnose.diagnosis_to_spec import updated_spec
from planner.errors import InfeasibleError, InputError
from planner.nouns.diagnosed_spreads import WHITE_OF_1_S, CampaignCost
from planner.nouns.diagnosis import Diagnosis
from planner.nouns.progress import Progress
from planner.spec.load import LoadedSpec, spec_from_bytes


def with_cost(
    diagnosis: Diagnosis,
    loaded: LoadedSpec,
    plan: Mapping[str, Any] | None,
    promised: Sequence[float],
    progress: Progress,
) -> Diagnosis:
    """The diagnosis with what its exceeded budgets cost; as it came where there are none, or no flight."""
    exceeded = diagnosis.found.budget_exceeded
    if not exceeded or loaded.absent:
        return diagnosis
    from planner.pipelines.navigation import navigate  # a quarter of a second that few diagnoses need

    progress(f"{diagnosis.found.unit}: what its spreads cost")
    try:
        navigation = navigate(loaded, progress)
    except InputError:
        return diagnosis  # published coefficients without a flight, or without these errors
    constraints = navigation.constraints
    if navigation.flight is not None and any(b.part == WHITE_OF_1_S for b in exceeded):
        constraints = with_noise(constraints, navigation.flight)
    told = in_flight(exceeded, constraints, loaded.spec.plan.confidence, promised)
    diagnosis = replace(diagnosis, found=replace(diagnosis.found, budget_exceeded=told))
    if plan is None or loaded.spec.planned_by != "information":
        return diagnosis
    return replace(diagnosis, campaign=_campaign(diagnosis, loaded, float(plan["time_s"]), progress))


def _campaign(
    diagnosis: Diagnosis, loaded: LoadedSpec, before: float, progress: Progress
) -> CampaignCost | None:
    """The shortest campaign under the spreads that were measured, and nothing else that was found."""
    from planner.pipelines.navigation import navigate
    from planner.pipelines.planning import informed

    bare = replace(diagnosis.found, effects=(), unknown=())
    try:
        made = updated_spec(loaded.text, loaded, replace(diagnosis, found=bare, navigation=()))
    except InputError:
        return None  # a budget that the spec gives in no form that could be corrected
    new = spec_from_bytes(made.text.encode(), loaded.path)
    progress(f"{diagnosis.found.unit}: planning with the spreads that were measured")
    try:
        found = informed(new, navigate(new, progress), progress, beside=False).plan
    except InfeasibleError as error:
        return CampaignCost(before, float("nan"), str(error).splitlines()[0])
    return CampaignCost(before, found.time_s)
