"""The flow of a plan: spec → sensitivities → allowances → repeats → schedule → plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from planner import __version__
from planner.errors import InfeasibleError, InputError, PlannerError
from planner.information.afford import Affordable, affordable
from planner.information.allowed import extreme_sizes, in_sizes
from planner.information.by_total import by_total as shortest_in_all
from planner.information.choose import Found, campaign_found
from planner.information.model_of import flight_of
from planner.information.pareto import genetic_beside
from planner.information.to_plan import plan_of as information_plan
from planner.information.unneeded import unneeded
from planner.nouns.allowances import AllowedErrors, ErrorModel
from planner.nouns.choices import Campaign
from planner.nouns.deadline import BESIDE, GENETIC, Deadline, never
from planner.nouns.plan import Plan, TradeOffPoint
from planner.nouns.progress import Progress, silent
from planner.nouns.sensitivities import Constraint, Sensitivities
from planner.nouns.trajectory import Trajectory
from planner.pipelines.remarks import causes_said, cut_short
from planner.plan.allowance_to_repeats import error_menus
from planner.plan.budget import common_rule
from planner.plan.by_hand import is_hand_made
from planner.plan.campaign_by_total import by_total
from planner.plan.campaign_to_plan import plan_of
from planner.plan.errors_to_points import point_menus
from planner.plan.genetic_campaign import genetic_plan, told_above
from planner.plan.genetic_settings import genetic_settings
from planner.plan.observable_campaign import observable_campaign, refuse_what_no_campaign_observes
from planner.plan.plan_to_schedule_figures import with_schedule_figures
from planner.plan.repeats_to_schedule import campaign
from planner.plan.schedule_to_steps import planned_tests, steps
from planner.plan.sensitivity_to_allowance import allowed_errors
from planner.plan.spec_to_errors import error_models
from planner.plan.spec_to_sensitivity import constraints as constraints_of
from planner.plan.spec_to_sensitivity import sensitivities as sensitivities_of
from planner.plan.spec_to_trajectory import aided, flight_path, trajectory_of
from planner.plan.task import Task, extreme_allowances, planning_task, within_seconds
from planner.plan.trade_off import trade_off
from planner.solvers.one_thread import one_thread
from planner.spec.height_aid import unaided
from planner.spec.load import LoadedSpec
from planner.spec.model import Given, PercentileRule, Spec

OF_PROOF = 0.8  # of the time that is left, for the published program: it begins with a quarter more
SURE = 0.95  # of the flights, for what a limit costs as a percentile


@dataclass(frozen=True)
class Navigation:
    """What the requirements ask of the sensors: errors, their sensitivities, the constraints."""

    models: tuple[ErrorModel, ...]
    sensitivities: Sensitivities | None
    constraints: tuple[Constraint, ...]
    trajectory: str
    flight: Trajectory | None = None

    @property
    def unaided(self) -> str | None:
        """What becomes of the height of a long flight that nothing holds."""
        t = self.flight
        return None if t is None or t.height_aid_m is not None else unaided(float(t.time_s[-1] - t.time_s[0]))


@dataclass(frozen=True)
class Planned:
    """A plan with everything that its report shows."""

    plan: Plan
    navigation: Navigation
    allowed: AllowedErrors | None


Answered = Callable[[Planned], None]


def nobody(planned: Planned) -> None:
    """For who waits for all of it."""
    del planned


def navigate(loaded: LoadedSpec, progress: Progress) -> Navigation:
    """Spec → errors, sensitivities on its trajectory (unless they are given), constraints."""
    spec = loaded.spec
    models = error_models(spec)
    if isinstance(spec.sensitivities, Given):
        return Navigation(models, None, constraints_of(spec, None), "published coefficients")
    progress("building the trajectory")
    trajectory = flight_path(spec, loaded.folder)
    progress("propagating the sensor errors")
    found = sensitivities_of(trajectory, [model.name for model in models], instants=_instants(spec))
    return Navigation(models, found, constraints_of(spec, found), trajectory.name, trajectory)


@one_thread()
def allow(
    loaded: LoadedSpec, progress: Progress, stop: Callable[[], bool] = never
) -> tuple[Navigation, AllowedErrors]:
    """Spec → the region of allowed sensor errors: genetic algorithm and exact optimum.

    stop: asked for every generation; once it says yes, the one that is there is the last
    """
    navigation = navigate(loaded, progress)
    if by_information(loaded.spec):
        return navigation, _allowed_in_flight(loaded.spec, navigation, progress, stop)
    task = task_of(loaded.spec, navigation)
    return navigation, _allowed(loaded.spec, task, navigation, progress, stop)


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
        if by_information(loaded.spec):
            return informed(loaded, navigation, progress, deadline=deadline, answered=answered)
        return _published(loaded, navigation, progress, deadline, answered)


def _published(
    loaded: LoadedSpec, navigation: Navigation, progress: Progress, deadline: Deadline, answered: Answered
) -> Planned:
    spec = loaded.spec
    task = task_of(spec, navigation)
    progress("choosing temperatures and repeats")
    in_hours = spec.plan.minimise == "time"  # the cost is seconds then, and nothing else
    told = deadline.report_bounded if in_hours else None
    exact = campaign(within_seconds(task, OF_PROOF * deadline.left), told)
    progress("the same with waiting and batches in sight")
    chosen = observable_campaign(task, by_total(within_seconds(task, deadline.left), exact))
    said, notes = _notes(loaded, navigation), list[str]()
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
    allowed, why_not = _allowed_or_why_not(spec, task, navigation, progress, late)
    progress("genetic algorithm beside the exact campaign")
    late = deadline.stops(BESIDE, "the genetic campaign")
    above = told_above(exact.objective, spec.plan.genetic.generations, progress)
    rule = common_rule(navigation.constraints)
    genetic = genetic_plan(task, exact, rule, genetic_settings(spec, late), spec.plan.seed, above)
    notes = [*said, *why_not, *made.notes[len(said) :]]
    return Planned(
        cut_short(replace(made, genetic=genetic, notes=tuple(notes)), deadline), navigation, allowed
    )


@one_thread()
def afford(loaded: LoadedSpec, seconds: float, progress: Progress) -> Affordable:
    """Spec and hours → the least limits, and the grade of sensor, that so much campaign can keep.

    Raises InputError for a spec that is not planned by information: only there are hours and metres one
    model.
    """
    spec = loaded.spec
    if not by_information(spec):
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
        if by_information(loaded.spec):
            return informed(loaded, navigation, progress, beside=False).plan
        progress("choosing temperatures and repeats")
        task = task_of(loaded.spec, navigation)
        chosen = observable_campaign(task, by_total(task, campaign(task)))
    return with_schedule_figures(_timed(loaded, navigation, task, chosen), loaded.spec, chosen)


def by_information(spec: Spec) -> bool:
    """Whether the plan promises what will be flown: requirements of probability, and a flight to see them on.

    `worst_case` is always the published method, and so is what stands beside it.
    """
    return spec.planned_by == "information"


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
    found = campaign_found(flight)
    if (spec.plan.shifts or spec.plan.units is not None) and not is_hand_made(spec):
        progress("the same with waiting and loads in sight")
        found = shortest_in_all(flight, found)
    remarks = [*unneeded(flight, found)] if beside and not is_hand_made(spec) else []
    made = information_plan(
        flight,
        found,
        navigation.models,
        navigation.constraints,
        version=__version__,
        sha256=loaded.sha256,
        notes=[*_notes(loaded, navigation), *remarks],
        priced=beside,
    )
    chosen = _chosen(found)
    curve: tuple[TradeOffPoint, ...] = ()
    if beside and spec.plan.trade_off and not is_hand_made(spec):
        progress("trade-off of campaign time and power-on time")
        curve = trade_off(spec, lambda other: _chosen(campaign_found(flight.under(other))), [chosen])
    made = with_schedule_figures(made, spec, chosen, curve)
    answered(Planned(cut_short(made, deadline), navigation, None))
    if beside:
        progress("genetic campaign beside it")
        late = deadline.stops(GENETIC, "the genetic campaign")
        made = replace(made, genetic=genetic_beside(flight, found, spec.plan.seed, late))
    return Planned(cut_short(made, deadline), navigation, None)


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


def _chosen(found: Found) -> Campaign:
    """A campaign by information as the schedule takes it."""
    return Campaign(
        found.visits, (), found.cost, found.bound, found.proved, found.total_bound, found.by_total
    )


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


def sensitivity(
    loaded: LoadedSpec, flight: Path | None, progress: Progress, *, at: float | None = None
) -> Sensitivities:
    """The linear-combination coefficients on the spec's trajectory, or on a flight from a file.

    at: a time of interest in seconds, at which the history then has an instant
    """
    choice = loaded.spec.trajectory if flight is None else {"file": str(flight.resolve())}
    progress("building the trajectory")
    trajectory = aided(trajectory_of(choice, loaded.folder), loaded.spec)
    progress("propagating the sensor errors")
    instants = [*_instants(loaded.spec), *([] if at is None else [at])]
    inside = [t for t in instants if trajectory.time_s[0] <= t <= trajectory.time_s[-1]]
    return sensitivities_of(trajectory, asked_errors(loaded.spec), instants=inside)


def asked_errors(spec: Spec) -> list[str]:
    """Bias and scale factor of both sensors always, then whatever else the spec speaks of."""
    basic = [f"{s}.{e}" for e in ("bias", "scale_factor") for s in ("gyro", "accelerometer")]
    return list(dict.fromkeys([*basic, *(model.name for model in error_models(spec))]))


def _instants(spec: Spec) -> list[float]:
    return [float(r.at) for r in spec.requirement if not isinstance(r.at, str)]


def task_of(spec: Spec, navigation: Navigation) -> Task:
    """What may be chosen, temperatures and repeats, and what each choice costs and leaves of the errors.

    Raises InputError when an error that the tests calibrate is unobservable in every campaign.
    """
    refuse_what_no_campaign_observes(spec)
    menus = error_menus(spec, navigation.models, point_menus(spec))
    return planning_task(spec, navigation.models, menus, navigation.constraints)


def _allowed(
    spec: Spec, task: Task, navigation: Navigation, progress: Progress, late: Callable[[], bool] = never
) -> AllowedErrors:
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


def _allowed_in_flight(
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


def _allowed_or_why_not(
    spec: Spec, task: Task, navigation: Navigation, progress: Progress, late: Callable[[], bool]
) -> tuple[AllowedErrors | None, list[str]]:
    """The allowed region beside a campaign that exists; with mixed rules there may be none.

    The region knows one size per error, so with mixed rules it must take the sum of the parts, which a
    percentile or rss requirement does not ask for.
    """
    try:
        return _allowed(spec, task, navigation, progress, late), []
    except InfeasibleError:
        if len({constraint.rule for constraint in navigation.constraints}) == 1:
            raise
        return None, [
            "no region of allowed errors: the requirements mix rules, and sums of parts exceed them"
        ]


def _notes(loaded: LoadedSpec, navigation: Navigation) -> list[str]:
    """The spec's warnings with their places, and what only the built flight shows.

    A model's own note only repeats one of them.
    """
    said = [f"{warning.path}: {warning.message}" for warning in loaded.warnings]
    remark = f"trajectory: {navigation.unaided}"
    return said if navigation.unaided is None or remark in said else [*said, remark]
