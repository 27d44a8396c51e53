"""Plans compared, from their plan.json documents: hours, what differs and why, error against hours.

Time is counted in whole microseconds, so that the reasons add up to the difference exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from planner.errors import InputError
from planner.nouns.plan_file import RequirementFigures, TestFigures
from planner.nouns.step import Step
from planner.report.numbers import degrees, digits, hours, plain, runs
from planner.report.plan_facts import MICROSECONDS, PlanDocument, PlanFacts, length, plan_facts
from planner.report.time_spent import action_order

WAITING = "no step, or steps in parallel"


@dataclass(frozen=True)
class Spent:
    """Microseconds of one heading in every plan, 0 where a plan has none."""

    name: str
    time_us: tuple[int, ...]


@dataclass(frozen=True)
class Reason:
    """One thing that differs between two plans, and the microseconds that it adds."""

    what: str
    why: str
    added_us: int


@dataclass(frozen=True)
class Difference:
    """One plan against the first: its reasons sum to `added_us` exactly."""

    plan: str
    added_us: int
    reasons: tuple[Reason, ...]


@dataclass(frozen=True)
class Reached:
    """One requirement of one plan: limit and what is achieved, in `unit`; None where the plan lacks it."""

    error: str
    at: str
    rule: str
    unit: str
    limit: tuple[float | None, ...]
    achieved: tuple[float | None, ...]


@dataclass(frozen=True)
class Allowed:
    """What every plan allows one sensor error, in `unit`; None where the plan lacks it."""

    error: str
    unit: str
    allowed: tuple[float | None, ...]


@dataclass(frozen=True)
class Comparison:
    """Two or more plans; tuples run over the plans in the order given, differences over all but the first."""

    plans: tuple[str, ...]
    spec_sha256: tuple[str, ...]
    time_us: tuple[int, ...]
    power_on_us: tuple[int, ...]
    gap: tuple[float | None, ...]
    benches: tuple[Spent, ...]
    tests: tuple[Spent, ...]
    actions: tuple[Spent, ...]
    requirements: tuple[Reached, ...]
    allowances: tuple[Allowed, ...]
    differences: tuple[Difference, ...]
    same_steps: bool

    @property
    def differ(self) -> bool:
        """Whether any plan does anything else, takes another time or reaches other figures than the first."""
        other_time = any(d.reasons or d.added_us for d in self.differences)
        pairs = [pair for r in self.requirements for pair in (r.limit, r.achieved)]
        return not self.same_steps or other_time or any(len(set(pair)) > 1 for pair in pairs)


def compare(plans: Sequence[PlanDocument]) -> Comparison:
    """Compare plan documents with the first one. Raises InputError for fewer than two, or a broken one."""
    if len(plans) < 2:
        raise InputError("compare needs two plans or more")
    facts = [plan_facts(plan, number) for number, plan in enumerate(plans, start=1)]
    names = _names(facts)
    return Comparison(
        plans=names,
        spec_sha256=tuple(plan.sha256 for plan in facts),
        time_us=tuple(plan.time_us for plan in facts),
        power_on_us=tuple(plan.power_on_us for plan in facts),
        gap=tuple(plan.gap for plan in facts),
        benches=_side_by_side(facts, lambda step: step.bench, list),
        tests=_side_by_side(facts, lambda step: step.test or "none", list),
        actions=_side_by_side(facts, lambda step: step.action, action_order),
        requirements=_requirements(facts),
        allowances=_allowances(facts),
        differences=tuple(
            _difference(name, facts[0], plan) for name, plan in zip(names[1:], facts[1:], strict=True)
        ),
        same_steps=all(plan.steps == facts[0].steps for plan in facts),
    )


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """The comparison as plain data; times in seconds, to the microsecond that they are counted in."""
    return {"differ": comparison.differ, **_in_seconds(asdict(comparison))}


def _in_seconds(value: Any) -> Any:
    """`…_us` as `…_s`, in all that lies within."""
    if isinstance(value, dict):
        return {
            f"{key.removesuffix('_us')}_s" if key.endswith("_us") else key: _seconds(one)
            if key.endswith("_us")
            else _in_seconds(one)
            for key, one in value.items()
        }
    return [_in_seconds(one) for one in value] if isinstance(value, (tuple, list)) else value


def _seconds(microseconds: int | tuple[int, ...]) -> float | list[float]:
    if isinstance(microseconds, int):
        return microseconds / MICROSECONDS
    return [one / MICROSECONDS for one in microseconds]


def _names(plans: Sequence[PlanFacts]) -> tuple[str, ...]:
    """Names of the specs, numbered where two are equal."""
    names = [plan.name for plan in plans]
    return tuple(name if names.count(name) == 1 else f"{name} ({i})" for i, name in enumerate(names, start=1))


# ---------------------------------------------------------------- side by side


def _side_by_side(
    plans: Sequence[PlanFacts],
    heading: Callable[[Step], str],
    order: Callable[[list[str]], list[str]],
) -> tuple[Spent, ...]:
    sums = [_sums(plan, heading) for plan in plans]
    names = order(list(dict.fromkeys(name for one in sums for name in one)))
    return tuple(Spent(name, tuple(one.get(name, 0) for one in sums)) for name in names)


def _sums(plan: PlanFacts, heading: Callable[[Step], str]) -> dict[str, int]:
    """Microseconds under every heading; what no step covers (or several do) stands under its own."""
    found: dict[str, int] = {}
    for step in plan.steps:
        name = heading(step)
        found[name] = found.get(name, 0) + length(step)
    rest = plan.time_us - sum(found.values())
    return {**found, WAITING: rest} if rest else found


def _requirements(plans: Sequence[PlanFacts]) -> tuple[Reached, ...]:
    """Requirements of all plans; the n-th one of a kind in one plan stands beside the n-th in the others."""
    tables = [_by_kind(plan) for plan in plans]
    kinds = dict.fromkeys(kind for table in tables for kind in table)
    rows = [[table.get(kind) for table in tables] for kind in kinds]
    return tuple(
        Reached(
            error=kind[0],
            at=kind[1],
            rule=kind[2],
            unit=kind[3],
            limit=tuple(figure.limit if figure else None for figure in row),
            achieved=tuple(figure.achieved if figure else None for figure in row),
        )
        for kind, row in zip(kinds, rows, strict=True)
    )


def _by_kind(plan: PlanFacts) -> dict[tuple[str, str, str, str, int], RequirementFigures]:
    found: dict[tuple[str, str, str, str, int], RequirementFigures] = {}
    for figure in plan.requirements:
        kind = (figure.error, figure.at, figure.rule, figure.unit)
        found[(*kind, sum(known[:4] == kind for known in found))] = figure
    return found


def _allowances(plans: Sequence[PlanFacts]) -> tuple[Allowed, ...]:
    kinds = dict.fromkeys(kind for plan in plans for kind in plan.allowances)
    return tuple(Allowed(*kind, tuple(plan.allowances.get(kind) for plan in plans)) for kind in kinds)


# ---------------------------------------------------------------- what differs and why


def _difference(name: str, first: PlanFacts, second: PlanFacts) -> Difference:
    found = [*_test_reasons(first, second), *_shared_reasons(first, second)]
    added = second.time_us - first.time_us
    rest = added - sum(reason.added_us for reason in found)
    if rest:
        found.append(Reason("timeline", WAITING, rest))
    return Difference(name, added, tuple(sorted(found, key=lambda reason: -abs(reason.added_us))))


def _test_reasons(first: PlanFacts, second: PlanFacts) -> list[Reason]:
    """One reason per test that differs: its own steps, without installing, ramps and soaks."""
    spent_a, spent_b = _of_tests(first), _of_tests(second)
    found = []
    for test in dict.fromkeys([*spent_a, *spent_b]):
        a, b = spent_a.get(test, 0), spent_b.get(test, 0)
        changes = _test_changes(first.tests.get(test), second.tests.get(test), a, b)
        if a != b or changes:
            found.append(Reason(test, ", ".join(changes) or "other steps", b - a))
    return found


def _of_tests(plan: PlanFacts) -> dict[str, int]:
    spent = dict.fromkeys(plan.tests, 0)
    for step in plan.steps:
        if step.test is not None:
            spent[step.test] = spent.get(step.test, 0) + length(step)
    return spent


def _test_changes(a: TestFigures | None, b: TestFigures | None, spent_a: int, spent_b: int) -> list[str]:
    """What changed in a test, in words."""
    if a is None or b is None:
        return ["new" if a is None else "dropped"]
    changes = [f"{a.bench} → {b.bench}"] if a.bench != b.bench else []
    if len(a.temperatures_degc) != len(b.temperatures_degc):
        changes.append(f"{len(a.temperatures_degc)} → {len(b.temperatures_degc)} temperatures")
    elif a.temperatures_degc != b.temperatures_degc:
        changes.append(f"temperatures {degrees(a.temperatures_degc)} → {degrees(b.temperatures_degc)}")
    if set(a.repeats) != set(b.repeats) or (len(set(a.repeats)) > 1 and a.repeats != b.repeats):
        changes.append(f"{_repeats(a)} → {_repeats(b)} repeats")
    if a.motions != b.motions:
        changes.append(f"{a.motions} → {b.motions} motions")
    each_a, each_b = (s / MICROSECONDS / max(sum(t.repeats), 1) for s, t in ((spent_a, a), (spent_b, b)))
    if abs(each_a - each_b) > 1e-3:  # a millisecond: rounding of a step's times is far below
        changes.append(plain(f"{digits(each_a)} → {digits(each_b)} s a repeat"))
    return changes


def _repeats(test: TestFigures) -> str:
    return plain(runs([str(n) for n in test.repeats])) or "0"


def _shared_reasons(first: PlanFacts, second: PlanFacts) -> list[Reason]:
    """One reason per bench and kind of action that no test owns: installing, ramps, soaks."""
    a, b = _shared(first), _shared(second)
    found = []
    for bench, action in dict.fromkeys([*a, *b]):
        (count_a, time_a), (count_b, time_b) = (x.get((bench, action), (0, 0)) for x in (a, b))
        if (count_a, time_a) != (count_b, time_b):
            why = f"{count_a} → {count_b}" if count_a != count_b else _lengths(count_a, time_a, time_b)
            found.append(Reason(f"{bench} {action.replace('_', ' ')}", why, time_b - time_a))
    return found


def _lengths(count: int, time_a: int, time_b: int) -> str:
    means = [hours(time / MICROSECONDS / count) for time in (time_a, time_b)]
    return plain(f"{count} as before, {' → '.join(means)} h each on average")


def _shared(plan: PlanFacts) -> Mapping[tuple[str, str], tuple[int, int]]:
    """(bench, action) -> how many and how long together."""
    found: dict[tuple[str, str], tuple[int, int]] = {}
    for step in plan.steps:
        if step.test is None:
            count, time = found.get((step.bench, step.action), (0, 0))
            found[step.bench, step.action] = (count + 1, time + length(step))
    return found
