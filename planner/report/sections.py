"""The report's sections in a reviewer's order; a section with nothing to say is left out."""

from __future__ import annotations

from collections.abc import Sequence

from planner.records import AllowedErrors, Constraint, Plan, Sensitivities
from planner.report import assumptions, figures, gantt, tables
from planner.report.blocks import Block, Folded, Items, Picture, Section, Text, section
from planner.report.budget import binding_constraint, contributions
from planner.report.numbers import digits, hours, percent, quantity
from planner.report.region import AllowedRegion, allowed_region, axes_of_region
from planner.report.schedule import schedule


def all_sections(
    plan: Plan,
    allowed: AllowedErrors | None,
    sensitivities: Sensitivities | None,
    constraints: Sequence[Constraint],
    spec_text: str,
    trajectory_name: str,
    service_life_s: float | None,
) -> tuple[Section, ...]:
    """Every section that this plan has something for."""
    found = (
        budget(plan, constraints),
        campaign(plan),
        hours_spent(plan, service_life_s),
        schedule(plan),
        section("tests", "Tests", tables.tests_table(plan) if plan.tests else None),
        repeats(plan),
        region(plan, constraints),
        pareto(plan, allowed),
        convergence(plan, allowed),
        sensitivity(plan, sensitivities),
        basis(plan, allowed, sensitivities, trajectory_name),
        section("spec", "The spec", Folded("Show the spec as it was read", spec_text) if spec_text else None),
    )
    return tuple(part for part in found if part is not None)


def budget(plan: Plan, constraints: Sequence[Constraint]) -> Section | None:
    """From metres to every sensor error to its parts."""
    if not plan.allowances:
        return None
    budgets = [contributions(plan, i, constraints) for i in range(len(plan.requirements))]
    return section(
        "budget",
        "From the requirement to each sensor error",
        Text(
            "Each bar is what one sensor error adds to the navigation error. Run to run, in run and storage "
            "stay whatever the campaign does; temperature points and repeats buy the other two."
        ),
        _picture(figures.budget_figure(plan, budgets), "Contribution of every error, split into its parts."),
        *tables.budget_tables(plan, budgets),
    )


def campaign(plan: Plan) -> Section | None:
    """The Gantt chart over temperature."""
    if not plan.steps:
        return None
    caption = (
        f"{len(plan.steps)} steps. Upper lane of a bench: what is done; lower lane: for which test. "
        f"Steps shorter than {plan.time_s / gantt.COLUMNS / 60:.1f} min share the height by their time."
    )
    return section("campaign", "The campaign", Picture(gantt.campaign_figure(plan), caption))


def hours_spent(plan: Plan, service_life_s: float | None) -> Section | None:
    """Hours by action, test, temperature and bench; power-on hours against the service life."""
    if not plan.steps:
        return None
    return section(
        "hours", "Where the hours go", Text(_power_on(plan, service_life_s)), *tables.hours_tables(plan)
    )


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
        tables.reasons_table(plan),
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
        )
    worst_case = all(requirement.rule == "worst_case" for requirement in plan.requirements)
    what = "A unit whose two errors lie inside meets" if worst_case else "Sizes of the two errors inside meet"
    caption = f"{_bounded_by(plan, found)}{what} every requirement while the other errors are as planned."
    return section("region", title, Picture(figures.region_figure(plan, found), caption))


def _bounded_by(plan: Plan, found: AllowedRegion) -> str:
    names = [plan.requirements[i].error.replace("_", " ") for i in sorted(set(found.requirement.tolist()))]
    return f"Bounded by {' and '.join(names)}. " if len(names) > 1 else ""


def pareto(plan: Plan, allowed: AllowedErrors | None) -> Section | None:
    """The Pareto set, its corners, and the genetic campaign beside the exact one."""
    return section(
        "pareto",
        "Other ways to share the budget",
        _picture(
            figures.front_figure(plan, figures.allowed_front(allowed), "front") if allowed else None,
            "Pareto set of the genetic algorithm: each line is one set of allowances that just meets the "
            "requirements; each axis runs from the smallest to the largest value in the set.",
        ),
        tables.corners_table(allowed),
        _picture(
            figures.front_figure(plan, figures.campaign_front(plan), "campaigns"),
            "Campaigns that the genetic algorithm kept: what each allows the errors, and how long it takes.",
        ),
        tables.genetic_table(plan),
    )


def convergence(plan: Plan, allowed: AllowedErrors | None) -> Section | None:
    """How the genetic algorithm got there."""
    runs: list[figures.Run] = []
    if allowed is not None:
        runs.append(figures.Run("allowed errors", "distance from the limit, %", 0.01, allowed.history))
    if plan.genetic is not None:
        exact = plan.objective_value
        runs.append(figures.Run("campaign", "campaign, h", 3600.0, plan.genetic.history, exact))
    picture = _picture(figures.convergence_figure(runs), "Fitness of the best and of the mean individual.")
    facts = tuple(
        f"{run.name}: {run.history.generations} generations, {run.history.evaluations} evaluations, "
        + (
            "stopped when it had converged."
            if run.history.stopped == "converged"
            else "stopped at the last one."
        )
        for run in runs
        if run.history.generations
    )
    return section(
        "convergence", "Convergence of the genetic algorithm", picture, Items(facts) if facts else None
    )


def sensitivity(plan: Plan, sensitivities: Sensitivities | None) -> Section | None:
    """What a unit of every error costs over the flight."""
    errors = [a.error for a in plan.allowances]
    picture = None
    if sensitivities is not None:
        shown = errors or list(dict.fromkeys(c.error for c in sensitivities.columns))
        picture = _picture(
            figures.sensitivity_figure(sensitivities, shown),
            "Length of the position error per unit of each error, by axis or term.",
        )
    return section("sensitivities", "Sensitivities", picture, tables.sensitivity_table(plan, sensitivities))


def basis(
    plan: Plan, allowed: AllowedErrors | None, sensitivities: Sensitivities | None, trajectory_name: str
) -> Section | None:
    """Assumptions, gaps and sources."""
    return section(
        "basis",
        "What this rests on",
        Text("Assumed:"),
        Items(assumptions.assumed(plan, sensitivities, trajectory_name)),
        Text("Not verified here:"),
        Items(assumptions.not_verified(plan, allowed)),
        Text("Sources:"),
        Items(assumptions.sources()),
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


def _picture(svg: str | None, caption: str) -> Block | None:
    return None if svg is None else Picture(svg, caption)
