"""Chosen campaign → the plan: requirements reached, the reason of every number, the price of the limit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from planner import catalog
from planner.nouns.allowances import Allowance
from planner.nouns.choices import Campaign, ErrorChoice, RepeatReason, TestVisits
from planner.nouns.plan import Achieved, GeneticPlan, Plan, PlannedTest, SensitivityFigure
from planner.nouns.sensitivities import Constraint
from planner.nouns.sensor import ErrorName
from planner.nouns.step import Step
from planner.plan.budget import common_rule, reached, size
from planner.plan.by_hand import fixed_repeats, is_hand_made
from planner.plan.confidence import half_width, half_widths, quantile, spread_at
from planner.plan.costs import repeat_power_on, repeat_time, weights_of
from planner.plan.spec_to_benches import planned_benches
from planner.plan.task import Task, allowances
from planner.solvers.linear_combination import shares, weights
from planner.spec.model import PercentileRule, Requirement, Spec
from planner.spec.plugins import foreign_plugins
from planner.units import unit_factor

WEAK = 0.25  # share of the uncalibrated size above which a half-width is worth a remark


def plan_of(
    task: Task,
    constraints: Sequence[Constraint],
    chosen: Campaign,
    timeline: Sequence[Step],
    tests: Sequence[PlannedTest],
    *,
    version: str,
    sha256: str,
    genetic: GeneticPlan | None,
    notes: Sequence[str],
) -> Plan:
    """Everything that plan.json and the report show, from the chosen campaign and its timeline."""
    spec, rule = task.spec, common_rule(constraints)
    allowed = allowances(task, chosen, rule)
    power_on = round(sum(test.power_on_s for test in tests), 6)
    timed_only = is_hand_made(spec)
    bound = chosen.objective if timed_only else chosen.bound
    return Plan(
        version=version,
        name=spec.name,
        spec_sha256=sha256,
        seed=spec.plan.seed,
        objective=objective_words(spec),
        requirements=tuple(_achieved(spec, i, constraints, allowed) for i in range(len(spec.requirement))),
        sensitivities=tuple(sensitivity_figures(spec, constraints, allowed)),
        allowances=allowed,
        tests=tuple(tests),
        steps=tuple(timeline),
        reasons=tuple(reason for choice in chosen.choices for reason in _reasons(task, chosen, choice)),
        time_s=round(timeline[-1].end_s, 6) if timeline else 0.0,
        bound_s=round(bound, 6),
        gap=0.0 if timed_only else chosen.gap,
        power_on_s=power_on,
        objective_value=round(chosen.objective, 6),
        objective_bound=round(bound, 6),
        proved=chosen.proved and not chosen.added,
        complete=chosen.proved,
        hours_per_limit={} if timed_only else _hours_per_limit(task, chosen, allowed, constraints),
        genetic=genetic,
        notes=(*notes, *_remarks(task, chosen, power_on), *idle_benches(spec, timeline)),
        benches=planned_benches(spec),
        plugins=foreign_plugins(spec),
    )


def _remarks(task: Task, chosen: Campaign, power_on: float) -> Iterator[str]:
    """On what was added to the campaign, on errors that are hardly known, on sensors that wear out."""
    yield from _said_of_added(chosen)
    yield from _hardly_known(task, chosen)
    yield from worn_out(task.spec, power_on)


def _said_of_added(chosen: Campaign) -> Iterator[str]:
    """Why the campaign is longer than the sizes of the errors ask for."""
    if chosen.added:
        yield (
            f"added so that the campaign as a whole tells the errors apart: {'; '.join(chosen.added)}; "
            "that no shorter campaign tells them is not proved"
        )


def _hardly_known(task: Task, chosen: Campaign) -> Iterator[str]:
    """Remarks on errors that their records determine weakly: the motions decide, not the power-ons."""
    models = {model.name: model for model in task.models}
    for choice in chosen.choices:
        model = models[choice.error]
        added, whole = model.within.get(choice.test, 0.0), model.whole_variation
        if added > model.largest_run_to_run and choice.half_width > WEAK * whole > 0:
            factor = unit_factor(model.unit)[0]
            yield (
                f"tests.{choice.test}: its motions determine {choice.error} weakly: it is known to "
                f"±{choice.half_width / factor:.3g} {model.unit}, uncalibrated it is up to "
                f"{whole / factor:.3g} {model.unit}; other motions tell more than more repeats"
            )


def worn_out(spec: Spec, power_on: float) -> Iterator[str]:
    """A remark on a campaign that outlives the sensors."""
    life = spec.unit.service_life
    if life is not None and power_on > life:
        yield (
            f"unit.service_life: the unit would be powered for {power_on / 3600:.2f} h, longer than the "
            f"{life / 3600:.4g} h that its sensors live; minimise power_on, or loosen the limit"
        )


def idle_benches(spec: Spec, timeline: Sequence[Step]) -> Iterator[str]:
    """A remark on each bench that the plan does not use; further ones of a kind only share its loads."""
    used = {step.bench for step in timeline}
    for name in spec.benches:
        first, _, number = name.rpartition("-")
        if name not in used and not (number.isdigit() and first in spec.benches):
            yield f"benches.{name}: idle: this plan makes no test on it"


def _tightest(index: int, constraints: Sequence[Constraint], allowed: Sequence[Allowance]) -> Constraint:
    """The instant at which a requirement is used most."""
    own = (c for c in constraints if c.requirement == index)
    return max(own, key=lambda c: reached(c, allowed) / c.limit)


def rule_name(requirement: Requirement) -> str:
    """`worst_case`, `rss` or `percentile 95 %`."""
    if isinstance(requirement.rule, PercentileRule):
        return f"percentile {requirement.rule.percentile * 100:g} %"
    return requirement.rule


def objective_words(spec: Spec) -> str:
    """What is made least, in words."""
    if is_hand_made(spec):
        return "nothing: the plan is made by hand"
    time, power_on = weights_of(spec)
    if power_on == 0:
        return "campaign time"
    return (
        "power-on time" if spec.plan.minimise == "power_on" else f"{time:g} × time + {power_on:g} × power-on"
    )


def _achieved(
    spec: Spec, index: int, constraints: Sequence[Constraint], allowed: Sequence[Allowance]
) -> Achieved:
    """The requirement at the instant where it is used most."""
    requirement = spec.requirement[index]
    constraint = _tightest(index, constraints, allowed)
    value = reached(constraint, allowed)
    sizes = np.array([size(tuple(a.parts.values()), constraint.rule) for a in allowed])
    names = [a.error for a in allowed]
    return Achieved(
        error=requirement.error,
        at=requirement.at if isinstance(requirement.at, str) else f"{requirement.at:g} s",
        rule=rule_name(requirement),
        unit=constraint.unit,
        limit=constraint.limit,
        achieved=value,
        met=value <= constraint.limit * (1 + 1e-9),
        shares=dict(zip(names, map(float, shares(constraint, names, sizes)), strict=True)),
    )


def sensitivity_figures(
    spec: Spec, constraints: Sequence[Constraint], allowed: Sequence[Allowance]
) -> Iterator[SensitivityFigure]:
    """Length of the error vector per display unit of every term, where each requirement is used most."""
    for index in range(len(spec.requirement)):
        constraint = _tightest(index, constraints, allowed)
        for a in allowed:
            vectors = np.atleast_2d(constraint.vectors.get(a.error, np.zeros((0, 1))))
            per = unit_factor(a.unit)[0] / unit_factor(constraint.unit)[0]
            for axis, vector in zip(_axes(a.error, len(vectors)), vectors, strict=True):
                value = float(np.linalg.norm(vector)) * per
                unit = constraint.unit if a.unit == "1" else f"{constraint.unit}/({a.unit})"
                yield SensitivityFigure(a.error, axis, value, unit, index)


def _axes(error: str, count: int) -> Sequence[str]:
    """Names of an error's terms; `all` for one published coefficient of all axes together."""
    sensor, effect = ErrorName(error).parts
    names = [term.name for term in catalog.effects()[effect].terms(sensor)]
    return names if count == len(names) else ["all"] * count


def _reasons(task: Task, chosen: Campaign, choice: ErrorChoice) -> Iterator[RepeatReason]:
    """Why this number, for every temperature of one error."""
    plan = task.spec.plan
    model = next(m for m in task.models if m.name == choice.error)
    visit = next(v for v in chosen.visits if v.test == choice.test)
    made = dict(zip(visit.temperatures_degc, visit.repeats, strict=True))
    by_hand = fixed_repeats(task.spec, choice.test) is not None
    points = choice.points.temperatures_degc
    spreads = spread_at(model, points, choice.test)
    for t, spread, needed in zip(points, spreads, choice.needed_repeats, strict=True):
        n = made[t]
        bound_by = "fixed" if by_hand else "shared" if n > needed else "accuracy"
        if bound_by == "accuracy" and n == plan.repeats.least:
            bound_by = "least"
        yield RepeatReason(
            error=choice.error,
            test=choice.test,
            temperature_degc=t,
            spread=float(spread),
            confidence=plan.confidence,
            quantile_name=plan.quantile,
            quantile=float(quantile(plan.confidence, plan.quantile, np.array([n]))[0]),
            repeats=n,
            half_width=float(half_widths(task.spec, model, choice.test, [t], [n])[0]),
            needed_half_width=choice.needed_half_width,
            bound_by=bound_by,  # type: ignore[arg-type]  # one of the words of `bound_by`, inferred as str
        )


def _hours_per_limit(
    task: Task, chosen: Campaign, allowed: Sequence[Allowance], constraints: Sequence[Constraint]
) -> Mapping[int, float]:
    """Hours that one more SI unit of each limit would save if repeats need not be whole.

    At the chosen temperatures, the repeats of each test scaled as a whole, so that the half-widths of all its
    errors move together: the dual value of the continuous relaxation (planner.solvers.convex).
    """
    from planner.solvers.convex import relaxed_time

    binding = {i: _tightest(i, constraints, allowed) for i in range(len(task.spec.requirement))}
    tests = _repeated(task, chosen)
    if not tests or any(c.rule != "worst_case" for c in binding.values()):
        return {}
    load = np.array([[_load(c, chosen, visit.test) for visit in tests] for c in binding.values()])
    left = np.array([c.limit - reached(c, allowed) for c in binding.values()]) + load.sum(axis=1)
    least = np.array([min(1.0, task.spec.plan.repeats.least / max(visit.repeats)) for visit in tests])
    if np.all(load @ least**-0.5 <= left):
        return dict.fromkeys(binding, 0.0)  # the fewest repeats suffice: a looser limit buys nothing here
    cost = np.array([_cost_of_width(task.spec, visit) for visit in tests])
    try:
        relaxed = relaxed_time(cost, np.ones(len(tests)), load, left, "worst_case", least)
    except ArithmeticError:  # no figure rather than one that the solver does not vouch for
        return {}
    return {i: float(d) / 3600 for i, d in zip(binding, relaxed.dual, strict=True)}


def _repeated(task: Task, chosen: Campaign) -> list[TestVisits]:
    """The tests whose repeats the planner chose."""
    served = {choice.test for choice in chosen.choices}
    return [v for v in chosen.visits if v.test in served and fixed_repeats(task.spec, v.test) is None]


def _load(constraint: Constraint, chosen: Campaign, test: str) -> float:
    """What the half-widths of all errors of a test add to a sum of moduli."""
    own = [choice for choice in chosen.choices if choice.test == test]
    return float(
        weights(constraint, [c.error for c in own]) @ np.array([choice.half_width for choice in own])
    )


def _cost_of_width(spec: Spec, visit: TestVisits) -> float:
    """Weighted seconds of a test's repeats, per unit of the exponent by which they narrow d = q(n) s / √n.

    d ∝ n^(−e) with e = 1/2 for the normal quantile and more for Student's, whose q falls as well: the price
    of a narrower d is the smaller for it, by 1/2 : e.
    """
    time, power = weights_of(spec)
    test, n = spec.tests[visit.test], max(visit.repeats)
    d = half_width(spec.plan.confidence, spec.plan.quantile, 1.0, [n, n + 1])
    exponent = float(np.log(d[0] / d[1]) / np.log((n + 1) / n))
    each = time * repeat_time(spec, test) + power * repeat_power_on(spec, test)
    return sum(visit.repeats) * each * 0.5 / exponent
