"""The flow of a plan: spec → sensitivities → campaign → schedule → plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from planner import __version__
from planner.errors import InputError
from planner.information.afford import Affordable, affordable
from planner.information.by_total import by_total as shortest_in_all
from planner.information.choose import Found, campaign_found
from planner.information.model_of import flight_of
from planner.information.pareto import genetic_beside
from planner.information.to_plan import plan_of as information_plan
from planner.information.unneeded import unneeded
from planner.nouns.choices import Campaign
from planner.nouns.deadline import GENETIC, Deadline, never
from planner.nouns.plan import Plan, TradeOffPoint
from planner.nouns.progress import Progress, silent
from planner.pipelines.navigation import Navigation, navigate
from planner.pipelines.planned import Answered, Planned, nobody, remarked
from planner.pipelines.published import exactly_published, published
from planner.pipelines.remarks import causes_said, cut_short
from planner.plan.by_hand import is_hand_made
from planner.plan.observable_campaign import left_open, refuse_what_no_campaign_observes
from planner.plan.plan_to_schedule_figures import with_schedule_figures
from planner.plan.trade_off import trade_off
from planner.solvers.one_thread import one_thread
from planner.spec.load import LoadedSpec


@one_thread()
def plan(
    loaded: LoadedSpec, progress: Progress, stop: Callable[[], bool] = never, answered: Answered = nobody
) -> Planned:
    """Spec → the shortest campaign that suffices, with its proof and its reasons.

    stop: asked again and again; once it says yes, the best so far is the answer
    answered: told the plan as soon as it is there, before genetic algorithms put anything beside it
    """
    deadline = Deadline(loaded.spec.plan.time_limit, stop=stop, say=progress)
    navigation = navigate(loaded, progress)
    with causes_said(loaded.spec, navigation.unaided):
        if loaded.spec.planned_by == "information":
            return informed(loaded, navigation, progress, deadline=deadline, answered=answered)
        return published(loaded, navigation, progress, deadline, answered)


@one_thread()
def afford(loaded: LoadedSpec, seconds: float, progress: Progress) -> Affordable:
    """Spec and hours → the least limits, and the grade of sensor, that so much campaign can keep.

    Raises InputError for a spec that is not planned by information: only there are hours and metres one
    model.
    """
    spec = loaded.spec
    if spec.planned_by != "information":
        raise InputError(
            "afford needs requirements of probability (rss or a percentile), simulated sensitivities and "
            "plan.method: information"
        )
    navigation = navigate(loaded, progress)
    assert navigation.flight is not None  # sensitivities are simulated
    progress("what the hours can keep")
    return affordable(flight_of(spec, navigation.flight, Deadline(spec.plan.time_limit)), seconds)


@one_thread()
def exact_plan(loaded: LoadedSpec, progress: Progress = silent) -> Plan:
    """Spec → campaign and steps as of `plan`; nothing that is searched beside them.

    No genetic algorithm, no trade-off, no prices, no notes.
    """
    navigation = navigate(loaded, progress)
    with causes_said(loaded.spec, navigation.unaided):
        if loaded.spec.planned_by == "information":
            return informed(loaded, navigation, progress, beside=False).plan
        return exactly_published(loaded, navigation, progress)


def informed(
    loaded: LoadedSpec,
    navigation: Navigation,
    progress: Progress,
    *,
    beside: bool = True,
    deadline: Deadline | None = None,
    answered: Answered = nobody,
) -> Planned:
    """The plan by information; beside: with what stands beside it in plan.json and report."""
    spec, deadline = loaded.spec, deadline or Deadline(loaded.spec.plan.time_limit)
    refuse_what_no_campaign_observes(spec)
    assert navigation.flight is not None  # sensitivities are simulated
    progress("what each record tells, what will be flown")
    flight = flight_of(spec, navigation.flight, deadline)
    found = campaign_found(flight, effort="thorough" if spec.plan.proof == "thorough" else "usual")
    if (spec.plan.shifts or spec.plan.units is not None) and not is_hand_made(spec):
        progress("the same with waiting and loads in sight")
        found = shortest_in_all(flight, found)
    remarks = [*(left_open(spec) if is_hand_made(spec) else unneeded(flight, found))] if beside else []
    if beside and not found.proved and spec.plan.proof == "quick":
        remarks.append(
            "that no campaign is shorter was looked into for about a second; plan.proof: thorough goes on, "
            f"within plan.time_limit ({deadline.seconds:g} s)"
        )
    made = information_plan(
        flight,
        found,
        navigation.models,
        navigation.constraints,
        version=__version__,
        sha256=loaded.sha256,
        notes=[*remarked(loaded, navigation), *remarks],
        priced=beside,
    )
    chosen = as_scheduled(found)
    curve: tuple[TradeOffPoint, ...] = ()
    if beside and spec.plan.trade_off and not is_hand_made(spec):
        progress("trade-off of campaign time and power-on time")
        curve = trade_off(spec, lambda other: as_scheduled(campaign_found(flight.under(other))), [chosen])
    made = with_schedule_figures(made, spec, chosen, curve)
    answered(Planned(cut_short(made, deadline), navigation, None))
    if beside:
        progress("genetic campaign beside it")
        late = deadline.stops(GENETIC, "the genetic campaign")
        made = replace(made, genetic=genetic_beside(flight, found, spec.plan.seed, late))
    return Planned(cut_short(made, deadline), navigation, None)


def as_scheduled(found: Found) -> Campaign:
    """A campaign by information as the schedule takes it."""
    return Campaign(
        found.visits, (), found.cost, found.bound, found.proved, found.total_bound, found.by_total
    )
