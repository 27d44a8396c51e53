"""What is proved of a plan, in one sentence."""

from __future__ import annotations

import math

from planner.records import Plan
from planner.report.numbers import hours, percent


def is_hand_made(plan: Plan) -> bool:
    """Whether the spec left nothing to choose, so that the plan was only timed."""
    return not math.isfinite(plan.gap) or all(r.bound_by == "fixed" for r in plan.reasons)


def proof(plan: Plan) -> str:
    """Proved optimal, within a gap, or timed only."""
    if is_hand_made(plan):
        return "Hand-made plan: timed, nothing was left to optimise."
    if plan.proved and plan.gap <= 1e-9:  # below that the bound differs by rounding
        return f"Proved: no campaign that meets the requirements does better (minimised: {plan.objective})."
    if plan.work_proved and not plan.proved:
        chosen = (
            "the shortest in total of those that were timed"
            if plan.by_total
            else "proved the best by working time, and none that was timed is shorter in total"
        )
        return (
            f"Temperatures and repeats: {chosen}. Their order: the best for this work. "
            f"No choice takes less than {hours(plan.bound_s)} h, waiting left out; what is above that, "
            f"{percent(plan.gap, 2)} of the total, is waiting or not proved (minimised: {plan.objective})."
        )
    return (
        f"Not proved: within {percent(plan.gap, 2)} of the best possible; "
        f"no campaign takes less than {hours(plan.bound_s)} h (minimised: {plan.objective})."
    )
