"""Chosen campaign → the plan: requirements reached, the reason of every number, the price of the limit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from planner import catalog
from planner.plan.budget import common_rule, reached, size
from planner.plan.by_hand import fixed_repeats, is_hand_made
from planner.plan.confidence import half_widths, quantile, spread_at
from planner.plan.costs import repeat_power_on, repeat_time, weights_of
from planner.plan.task import Task, allowances
from planner.records import (
    Achieved,
    Allowance,
    Campaign,
    Constraint,
    ErrorChoice,
    GeneticPlan,
    Plan,
    PlannedTest,
    RepeatReason,
    SensitivityFigure,
    Step,
)
from planner.solvers.linear_combination import shares, weights
from planner.spec.model import PercentileRule, Requirement, Spec
from planner.units import unit_factor


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
    time = round(timeline[-1].end_s, 6) if timeline else 0.0
    timed_only = is_hand_made(spec)
    bound = chosen.objective if timed_only else chosen.bound
    return Plan(
        version=version,
        name=spec.name,
        spec_sha256=sha256,
        seed=spec.plan.seed,
        objective="nothing: the plan is made by hand" if timed_only else _objective(spec),
        requirements=tuple(_achieved(spec, i, constraints, allowed) for i in range(len(spec.requirement))),
        sensitivities=tuple(_figures(spec, constraints, allowed)),
        allowances=allowed,
        tests=tuple(tests),
        steps=tuple(timeline),
        reasons=tuple(reason for choice in chosen.choices for reason in _reasons(task, chosen, choice)),
        time_s=time,
        bound_s=round(bound, 6),
        gap=0.0 if timed_only else chosen.gap,
        power_on_s=round(sum(test.power_on_s for test in tests), 6),
        objective_value=round(chosen.objective, 6),
        objective_bound=round(bound, 6),
        proved=chosen.proved,
        hours_per_limit={} if timed_only else _hours_per_limit(task, chosen, constraints),
        genetic=genetic,
        notes=tuple(notes),
    )


def requirement_limit_of(constraints: Sequence[Constraint], index: int) -> list[Constraint]:
    """The constraints (instants) that one requirement became."""
    return [c for c in constraints if c.requirement == index]


def rule_name(requirement: Requirement) -> str:
    """`worst_case`, `rss` or `percentile 95 %`."""
    if isinstance(requirement.rule, PercentileRule):
        return f"percentile {requirement.rule.percentile * 100:g} %"
    return requirement.rule


def _objective(spec: Spec) -> str:
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
    own = requirement_limit_of(constraints, index)
    values = [reached(c, allowed) for c in own]
    worst = int(np.argmax([v / c.limit for v, c in zip(values, own, strict=True)]))
    constraint = own[worst]
    sizes = np.array([size(tuple(a.parts.values()), constraint.rule) for a in allowed])
    names = [a.error for a in allowed]
    return Achieved(
        error=requirement.error,
        at=requirement.at if isinstance(requirement.at, str) else f"{requirement.at:g} s",
        rule=rule_name(requirement),
        unit=constraint.unit,
        limit=constraint.limit,
        achieved=values[worst],
        met=values[worst] <= constraint.limit * (1 + 1e-9),
        shares=dict(zip(names, map(float, shares(constraint, names, sizes)), strict=True)),
    )


def _figures(
    spec: Spec, constraints: Sequence[Constraint], allowed: Sequence[Allowance]
) -> Iterator[SensitivityFigure]:
    """Length of the error vector per display unit of every term, at each requirement's own instant."""
    for index in range(len(spec.requirement)):
        constraint = requirement_limit_of(constraints, index)[-1]
        for a in allowed:
            vectors = np.atleast_2d(constraint.vectors.get(a.error, np.zeros((0, 1))))
            per = unit_factor(a.unit)[0] / unit_factor(constraint.unit)[0]
            for axis, vector in zip(_axes(a.error, len(vectors)), vectors, strict=True):
                value = float(np.linalg.norm(vector)) * per
                unit = constraint.unit if a.unit == "1" else f"{constraint.unit}/({a.unit})"
                yield SensitivityFigure(a.error, axis, value, unit, index)


def _axes(error: str, count: int) -> Sequence[str]:
    """Names of an error's terms; `all` for one published coefficient of all axes together."""
    sensor, effect = error.split(".")
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
    spreads = spread_at(model, points)
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
            half_width=float(half_widths(task.spec, model, [t], [n])[0]),
            needed_half_width=choice.needed_half_width,
            bound_by=bound_by,  # type: ignore[arg-type]
        )


def _hours_per_limit(task: Task, chosen: Campaign, constraints: Sequence[Constraint]) -> Mapping[int, float]:
    """Hours that one more SI unit of each limit would save if repeats need not be whole.

    At the chosen temperatures, with the errors that decide the repeats of their tests free and the other
    parts as they are: the dual value of the continuous relaxation (planner.solvers.convex).
    """
    from planner.solvers.convex import relaxed_time

    deciding = _deciding(task, chosen)
    binding = {i: requirement_limit_of(constraints, i)[-1] for i in range(len(task.spec.requirement))}
    if not deciding or any(c.rule != "worst_case" for c in binding.values()):
        return {}
    names = [choice.error for choice in deciding]
    allowed = allowances(task, chosen, "worst_case")
    load = np.array([weights(c, names) for c in binding.values()])
    widths = np.array([choice.half_width for choice in deciding])
    left = np.array([c.limit - reached(c, allowed) for c in binding.values()]) + load @ widths
    time, power = weights_of(task.spec)
    tests = [task.spec.tests[choice.test] for choice in deciding]
    cost = np.array(
        [
            len(choice.points.temperatures_degc)
            * (time * repeat_time(task.spec, test) + power * repeat_power_on(task.spec, test))
            for choice, test in zip(deciding, tests, strict=True)
        ]
    )
    spread = np.array([choice.half_width * np.sqrt(max(choice.needed_repeats)) for choice in deciding])
    least = np.array(task.spec.plan.repeats.least)
    if np.all(load @ (spread / np.sqrt(least)) <= left):
        return dict.fromkeys(binding, 0.0)  # the fewest repeats suffice: a looser limit buys nothing here
    try:
        relaxed = relaxed_time(cost, spread, load, left, "worst_case", least)
    except ArithmeticError:  # no figure rather than one that the solver does not vouch for
        return {}
    return {i: float(d) / 3600 for i, d in zip(binding, relaxed.dual, strict=True)}


def _deciding(task: Task, chosen: Campaign) -> list[ErrorChoice]:
    """Per test the error whose accuracy asks for most repeats; the others ride along."""
    found: dict[str, ErrorChoice] = {}
    for choice in chosen.choices:
        if fixed_repeats(task.spec, choice.test) is not None:
            continue
        rival = found.get(choice.test)
        if rival is None or max(choice.needed_repeats) > max(rival.needed_repeats):
            found[choice.test] = choice
    return list(found.values())
