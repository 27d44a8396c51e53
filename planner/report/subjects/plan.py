"""A plan: the hours, what is proved, the promise, and in a reviewer's order why it suffices."""

from __future__ import annotations

from collections.abc import Sequence

from planner.nouns.allowances import AllowedErrors
from planner.nouns.plan import Achieved, Plan
from planner.nouns.sensitivities import Constraint, Sensitivities
from planner.plan.error_over_flight import error_over_flight, planned_sizes
from planner.report.blocks import (
    Fact,
    Folded,
    Items,
    Report,
    Section,
    Text,
    Verdict,
    existing,
    facts,
    section,
)
from planner.report.charts import flight_time
from planner.report.charts import plan as charts
from planner.report.contributions import binding_constraint, contributions, is_sum
from planner.report.numbers import days, digits, hours, percent, quantity, when
from planner.report.readable import sensitivities_in, units_of
from planner.report.region_of_two import AllowedRegion, allowed_region, axes_of_region
from planner.report.subjects import plan_basis, plan_promise, plan_tables
from planner.report.subjects.plan_loads import loads
from planner.report.subjects.plan_schedule import schedule

_FLOWN = {
    "range": "flights over the whole range of temperatures",
    "worst": "flights at the worst temperature",
    "flight": "at the flight's own temperature",
}


def plan_report(
    plan: Plan,
    *,
    allowed: AllowedErrors | None = None,
    sensitivities: Sensitivities | None = None,
    constraints: Sequence[Constraint] = (),
    spec_text: str = "",
    trajectory_name: str = "",
    service_life_s: float | None = None,
) -> Report:
    """The report of a plan; what is not given has no section.

    spec_text: shown as it is; service_life_s: compared with the power-on hours
    """
    sensitivities = sensitivities_in(sensitivities, units_of(plan)) if sensitivities else None
    long = f" ({days(plan.time_s)})" if days(plan.time_s) else ""
    whole = (
        _promised(plan, constraints, service_life_s)
        if plan.method == "information"
        else _published(plan, constraints, allowed, service_life_s)
    )
    folded = Folded("Show the spec as it was read", spec_text) if spec_text else None
    return Report(
        kind="Calibration plan",
        title=plan.name,
        answer=f"{hours(plan.time_s)} h{long}",
        sentences=plan_basis.proof(plan),
        verdicts=tuple(
            verdict(r, why) for r, why in zip(plan.requirements, _whys(plan, constraints), strict=True)
        ),
        notes=tuple(plan.notes),
        facts=_facts(plan, trajectory_name),
        sections=existing(
            *whole,
            convergence(plan, allowed),
            over_flight(plan, sensitivities, constraints),
            sensitivity(plan, sensitivities),
            basis(plan, allowed, sensitivities, trajectory_name),
            section("spec", "The spec", folded),
        ),
    )


def _promised(
    plan: Plan, constraints: Sequence[Constraint], service_life_s: float | None
) -> tuple[Section | None, ...]:
    """A plan by information: the campaign first, then what binds and what it is worth."""
    return (
        plan_promise.campaign(plan),
        plan_promise.binding(plan, constraints),
        loads(plan),
        section("proof", "What is proved", *map(Text, plan_basis.proved_among(plan))),
        budget(plan, constraints, plan_promise.BUDGET),
        plan_promise.worth(plan),
        hours_spent(plan, service_life_s),
        schedule(plan),
        plan_promise.repeats(plan),
        plan_promise.other_campaigns(plan),
    )


def _published(
    plan: Plan,
    constraints: Sequence[Constraint],
    allowed: AllowedErrors | None,
    service_life_s: float | None,
) -> tuple[Section | None, ...]:
    """A plan by half-widths and sums: the campaign, then what the limits are used for."""
    return (
        plan_promise.campaign(plan),
        loads(plan),
        budget(plan, constraints, BUDGET),
        hours_spent(plan, service_life_s),
        schedule(plan),
        repeats(plan),
        region(plan, constraints),
        pareto(plan, allowed),
    )


def _whys(plan: Plan, constraints: Sequence[Constraint]) -> tuple[tuple[str, ...], ...]:
    """What stands under each verdict: what binds, unless it has a section of its own."""
    if plan.method == "information":
        return ((),) * len(plan.requirements)
    return tuple((said,) for said in what_binds(plan, constraints))


def verdict(achieved: Achieved, why: tuple[str, ...]) -> Verdict:
    """The requirement's line; why: what stands under it."""
    sign = "≤" if achieved.met else ">"
    reached, limit = (quantity(value, achieved.unit) for value in (achieved.achieved, achieved.limit))
    at = f", {_FLOWN[achieved.temperature]}" if achieved.temperature in _FLOWN else ""
    factor = achieved.spread_factor
    times = f" × {factor:.4g} for spreads that are estimates" if factor >= ROOM_SHOWN else ""
    room = achieved.limit - achieved.achieved * factor
    margin = f"{quantity(abs(room), achieved.unit, 3)}, {percent(abs(room) / achieved.limit)}"
    return Verdict(
        f"{achieved.error}: {reached}{times} {sign} {limit}",
        f"{'margin' if room >= 0 else 'over by'} {margin}; "
        f"{when(achieved.at)}, {achieved.rule.replace('_', ' ')}{at}",
        achieved.achieved,
        achieved.limit,
        achieved.met,
        word="met" if achieved.met else "NOT met",
        why=why,
    )


def _facts(plan: Plan, trajectory_name: str) -> tuple[Fact, ...]:
    """Where the plan comes from."""
    return facts(
        ("sensitivities from", trajectory_name),
        ("minimised", plan.objective.replace("_", " ")),
        ("powered", f"{hours(plan.power_on_s)} h"),
        ("steps", str(len(plan.steps))),
        ("seed", str(plan.seed)),
        ("spec (SHA-256)", plan.spec_sha256),
        brief=("powered", "steps"),
    )


ROOM_SHOWN = 1.0005  # times a figure, below which four digits do not show it
BUDGET = (
    "Each bar is what one sensor error adds to the navigation error. Run to run, in run and storage stay "
    "whatever the campaign does; temperature points and repeats buy the other two."
)


def budget(plan: Plan, constraints: Sequence[Constraint], words: str) -> Section | None:
    """From metres to every sensor error to its parts. words: what a bar is, and what a campaign can buy."""
    if not plan.allowances:
        return None
    budgets = [contributions(plan, i, constraints) for i in range(len(plan.requirements))]
    return section(
        "budget",
        "From the requirement to each sensor error",
        Text(words, only="page"),
        charts.budget_picture(plan, budgets),
        *plan_tables.budget_tables(plan, budgets),
    )


def hours_spent(plan: Plan, service_life_s: float | None) -> Section | None:
    """Hours by action, test, temperature and bench; power-on hours against the service life."""
    if not plan.steps:
        return None
    powered = Text(_power_on(plan, service_life_s))
    return section("hours", "Where the hours go", powered, *plan_tables.hours_tables(plan), only="page")


def repeats(plan: Plan) -> Section | None:
    """Why this number of repeats."""
    return section(
        "repeats",
        "Why this number of repeats",
        Text(
            "The mean of n power-ons is known to d = t·s/√n. s: spread of what one power-on measures, "
            "from power-on to power-on and between its records; t: quantile; d: the half-width that the "
            "budget leaves for the estimate. What sets n: the accuracy asked for; the spec's least; a record "
            "shared with an error that needs more; or the spec, fixed by hand."
        )
        if plan.reasons
        else None,
        plan_tables.reasons_table(plan),
        only="page",
    )


def region(plan: Plan, constraints: Sequence[Constraint]) -> Section | None:
    """The allowed region of the two biases."""
    pair = axes_of_region(plan, constraints)
    if pair is None:
        return None
    title = f"Allowed region of {pair[0]} and {pair[1]}"
    found = allowed_region(plan, constraints, pair)
    if found is None:
        return section(
            "region",
            title,
            Text("There is none: the other errors, as planned, use up a requirement by themselves."),
            only="page",
        )
    worst_case = all(requirement.rule == "worst_case" for requirement in plan.requirements)
    what = "A unit whose two errors lie inside meets" if worst_case else "Sizes of the two errors inside meet"
    caption = f"{_bounded_by(plan, found)}{what} every requirement while the other errors are as planned."
    return section("region", title, charts.region_picture(plan, found, caption), only="page")


def _bounded_by(plan: Plan, found: AllowedRegion) -> str:
    names = [plan.requirements[i].error.replace("_", " ") for i in sorted(set(found.requirement.tolist()))]
    return f"Bounded by {' and '.join(names)}. " if len(names) > 1 else ""


def pareto(plan: Plan, allowed: AllowedErrors | None) -> Section | None:
    """The Pareto set, its corners, and the genetic campaign beside the exact one."""
    return section(
        "pareto",
        "Other ways to share the budget",
        charts.front_picture(
            plan,
            charts.allowed_front(allowed),
            "front",
            "Pareto set of the genetic algorithm: each line is one set of allowances that just meets the "
            "requirements; each axis runs from the smallest to the largest value in the set.",
        ),
        plan_tables.corners_table(allowed),
        charts.front_picture(
            plan,
            charts.campaign_front(plan),
            "campaigns",
            "Campaigns that the genetic algorithm kept: what each allows the errors, and how long it takes.",
        ),
        plan_tables.genetic_table(plan),
        only="page",
    )


def convergence(plan: Plan, allowed: AllowedErrors | None) -> Section | None:
    """How the genetic algorithm got there."""
    runs: list[charts.Run] = []
    if allowed is not None:
        runs.append(charts.Run("allowed errors", "distance from the limit, %", 0.01, allowed.history))
    if plan.genetic is not None:
        exact = plan.objective_value
        beside = "the plan" if plan.method == "information" else "exact optimum"
        runs.append(charts.Run("campaign", "campaign, h", 3600.0, plan.genetic.history, exact, beside))
    said = tuple(
        f"{run.name}: {run.history.generations} generations, {run.history.evaluations} evaluations, stopped "
        + ("when it had converged." if run.history.stopped == "converged" else "at the last one.")
        for run in runs
        if run.history.generations
    )
    title = "Convergence of the genetic algorithm"
    picture = charts.convergence_picture(runs)
    return section("convergence", title, picture, Items(said) if said else None, only="page")


def sensitivity(plan: Plan, sensitivities: Sensitivities | None) -> Section | None:
    """What a unit of every error costs over the flight."""
    picture = None
    if sensitivities is not None:
        every = dict.fromkeys(c.error for c in sensitivities.columns)
        shown = [a.error for a in plan.allowances] or list(every)
        picture = charts.sensitivity_picture(sensitivities, shown)
    told = plan_tables.sensitivity_table(plan, sensitivities)
    return section("sensitivities", "Sensitivities", picture, told, only="page")


_SUMS = (
    "Up to the instant of the requirement, errors as the plan leaves them, with the worst sign. By axis: "
    "gyro and accelerometer of an axis together."
)
_SQUARES = (
    "Up to the instant of the requirement. Each error's part of the promise there, grown as its sensitivity "
    "grows; parts add in squares. By axis: gyro and accelerometer of an axis together."
)


def over_flight(
    plan: Plan, sensitivities: Sensitivities | None, constraints: Sequence[Constraint]
) -> Section | None:
    """What every sensor error, and every axis, adds to each requirement over the time of flight."""
    if sensitivities is None:
        return None
    pictures = []
    for i, achieved in enumerate(plan.requirements):
        binding = binding_constraint(plan, i, constraints)
        if binding is None:
            continue
        curves = error_over_flight(
            sensitivities,
            planned_sizes(achieved, binding),
            achieved.error,
            adds=is_sum(achieved),
            until=binding.time_s,
        )
        caption = _SUMS if is_sum(achieved) else _SQUARES
        pictures.append(
            flight_time.over_flight_picture(curves, f"over-flight-{i}", caption, limit=achieved.limit)
        )
    return section("over-flight", "The error over the time of flight", *pictures, only="page")


def basis(
    plan: Plan, allowed: AllowedErrors | None, sensitivities: Sensitivities | None, trajectory_name: str
) -> Section | None:
    """Assumptions, gaps and sources."""
    return section(
        "basis",
        "What this rests on",
        Items(plan_basis.assumed(plan, sensitivities, trajectory_name), "Assumed:"),
        Items(plan_basis.not_verified(plan, allowed), "Not verified here:"),
        Items(plan_basis.sources(plan), "Sources:"),
        only="page",
    )


_SMALL_STEP = 0.01  # of the limit: hours per limit are a slope, so they are shown for a step that is small


def what_binds(plan: Plan, constraints: Sequence[Constraint]) -> tuple[str, ...]:
    """One sentence per requirement: when it is tightest, what uses most of it, what more room would save."""
    found = []
    for i, achieved in enumerate(plan.requirements):
        budget_ = contributions(plan, i, constraints)
        binding = binding_constraint(plan, i, constraints)
        text = f"{achieved.error}: {percent(achieved.achieved / achieved.limit)} of the limit is used"
        if achieved.at == "any" and binding is not None:
            text += f", tightest at {binding.time_s:.4g} s of flight"
        if budget_ and budget_[0].share > 0:
            text += f"; the largest part is {budget_[0].error} ({percent(budget_[0].share)})"
        saved = plan.hours_per_limit.get(i, 0.0) * _SMALL_STEP * achieved.limit
        if saved * 3600 > 36:  # less than the 0.01 h that a figure shows is nothing
            step = quantity(_SMALL_STEP * achieved.limit, achieved.unit, 2)
            text += f"; a limit {step} (1 %) wider would save about {digits(saved, 2)} h"
        found.append(text + ".")
    return tuple(found)


def _power_on(plan: Plan, service_life_s: float | None) -> str:
    powered = hours(plan.power_on_s)
    text = (
        f"The unit is powered for {powered} h ({percent(plan.power_on_s / (plan.time_s or 1))} of the time)"
    )
    if service_life_s:
        share = percent(plan.power_on_s / service_life_s)
        text += f", which is {share} of its service life of {digits(service_life_s / 3600)} h"
    return text + "."
