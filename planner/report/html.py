"""One self-contained page that opens offline: the plan, why it suffices, and what it rests on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from planner.records import Achieved, AllowedErrors, Constraint, Plan, Sensitivities
from planner.report.numbers import days, hours, quantity, when
from planner.report.page_template import page_template
from planner.report.proof import proof
from planner.report.readable import allowed_in, plan_in, sensitivities_in, units_of
from planner.report.sections import all_sections, what_binds


@dataclass(frozen=True)
class Verdict:
    """One requirement in the headline: a sentence, a bar up to the limit, and whether it is met."""

    text: str
    detail: str
    used: str
    limit_at: str
    met: bool


@dataclass(frozen=True)
class Fact:
    """A name and its value in the headline."""

    name: str
    value: str


def report_html(
    plan: Plan,
    *,
    allowed: AllowedErrors | None,
    sensitivities: Sensitivities | None,
    constraints: Sequence[Constraint],
    spec_text: str,
    trajectory_name: str,
    service_life_s: float | None = None,
) -> str:
    """The report as text: the same plan gives the same bytes.

    spec_text is shown as it is (escaped); service_life_s, if given, is compared with the power-on hours.
    """
    units = units_of(plan)
    plan = plan_in(plan, units)
    allowed = allowed_in(allowed, units) if allowed else None
    sensitivities = sensitivities_in(sensitivities, units) if sensitivities else None
    sections = all_sections(
        plan, allowed, sensitivities, constraints, spec_text, trajectory_name, service_life_s
    )
    return page_template("report.html.j2").render(
        name=plan.name,
        hours=hours(plan.time_s),
        days=days(plan.time_s),
        proof=proof(plan),
        verdicts=[verdict(achieved) for achieved in plan.requirements],
        met=all(achieved.met for achieved in plan.requirements),
        binds=what_binds(plan, constraints),
        facts=facts(plan, trajectory_name),
        notes=plan.notes,
        sections=sections,
    )


def verdict(achieved: Achieved) -> Verdict:
    """The requirement's line; the bar ends at the larger of the limit and what was reached."""
    end = max(achieved.achieved, achieved.limit) * 1.05 or 1.0
    sign = "≤" if achieved.met else ">"
    reached, limit = (quantity(value, achieved.unit) for value in (achieved.achieved, achieved.limit))
    return Verdict(
        f"{achieved.error}: {reached} {sign} {limit}",
        f"{when(achieved.at)}, {achieved.rule.replace('_', ' ')}: " + ("met" if achieved.met else "NOT met"),
        f"{100 * achieved.achieved / end:.2f}%",
        f"{100 * achieved.limit / end:.2f}%",
        achieved.met,
    )


def facts(plan: Plan, trajectory_name: str) -> list[Fact]:
    """Where the plan comes from."""
    found = [
        Fact("sensitivities from", trajectory_name),
        Fact("minimised", plan.objective.replace("_", " ")),
        Fact("powered", f"{hours(plan.power_on_s)} h"),
        Fact("steps", str(len(plan.steps))),
        Fact("planner", plan.version),
        Fact("seed", str(plan.seed)),
        Fact("spec (SHA-256)", plan.spec_sha256),
    ]
    return [fact for fact in found if fact.value]
