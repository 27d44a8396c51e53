"""plan.json: the plan as data, in display units (interfaces, section 3)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from planner.records import Achieved, Allowance, GeneticPlan, Plan, RepeatReason, Step
from planner.units import from_si

# Twelve digits tell every figure apart and hide the rounding of unit conversions (0.002 stays 0.002).
DIGITS = 12


def plan_document(plan: Plan) -> dict[str, Any]:
    """The plan as a tree of plain values, in the order in which plan.json holds them."""
    return {
        "planner": plan.version,
        "spec": {"name": plan.name, "sha256": plan.spec_sha256},
        "seed": plan.seed,
        "objective": {
            "minimise": plan.objective,
            "value_s": number(plan.objective_value),
            "bound_s": number(plan.objective_bound),
        },
        "time_s": number(plan.time_s),
        "bound_s": number(plan.bound_s),
        "gap": number(plan.gap),
        "proved": plan.proved,
        "power_on_s": number(plan.power_on_s),
        "requirements": [_requirement(r) for r in plan.requirements],
        "sensitivities": [
            {
                "error": s.error,
                "axis": s.axis,
                "value": number(s.value),
                "unit": s.unit,
                "requirement": s.requirement,
            }
            for s in plan.sensitivities
        ],
        "allowances": {a.error: _allowance(a) for a in plan.allowances},
        "tests": [
            {
                "test": t.test,
                "bench": t.bench,
                "calibrates": list(t.calibrates),
                "motions": t.motions,
                "temperatures_degc": [number(x) for x in t.temperatures_degc],
                "repeats": list(t.repeats),
                "time_s": number(t.time_s),
                "power_on_s": number(t.power_on_s),
            }
            for t in plan.tests
        ],
        "reasons": [_reason(r, plan) for r in plan.reasons],
        "genetic": None if plan.genetic is None else _genetic(plan.genetic, plan),
        "hours_per_limit": {str(k): number(v) for k, v in plan.hours_per_limit.items()},
        "notes": list(plan.notes),
        "steps": [step_document(step) for step in plan.steps],
    }


def plan_text(plan: Plan) -> str:
    """plan.json; one line a step, so that a diff of two plans reads like a list of changes."""
    document = plan_document(plan)
    steps = document.pop("steps")
    head = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    lines = ",\n  ".join(json.dumps(s, ensure_ascii=False, allow_nan=False) for s in steps)
    return f'{head[:-2]},\n "steps": [\n  {lines}\n ]\n}}\n'


def step_document(step: Step) -> dict[str, Any]:
    """One step with every key of the interfaces."""
    return {
        "id": step.id,
        "bench": step.bench,
        "action": step.action,
        "start_s": number(step.start_s),
        "end_s": number(step.end_s),
        "test": step.test,
        "temperature_degc": None if step.temperature_degc is None else number(step.temperature_degc),
        "repeat": step.repeat,
        "motion": None if step.motion is None else {k: number(v) for k, v in step.motion.items()},
        "units": step.units,
    }


def number(value: float) -> float | int:
    """A figure rounded to DIGITS digits; whole figures stay whole."""
    rounded = float(f"{value:.{DIGITS}g}")
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e15 else rounded


def _requirement(r: Achieved) -> Mapping[str, Any]:
    return {
        "error": r.error,
        "at": r.at,
        "rule": r.rule,
        "limit": number(from_si(r.limit, r.unit)),
        "achieved": number(from_si(r.achieved, r.unit)),
        "unit": r.unit,
        "met": r.met,
        "shares": {error: number(share) for error, share in r.shares.items()},
    }


def _allowance(a: Allowance) -> Mapping[str, Any]:
    return {
        "allowed": number(from_si(a.allowed, a.unit)),
        "unit": a.unit,
        "parts": {name: number(from_si(value, a.unit)) for name, value in a.parts.items()},
    }


def _reason(r: RepeatReason, plan: Plan) -> Mapping[str, Any]:
    unit = next(a.unit for a in plan.allowances if a.error == r.error)
    return {
        "error": r.error,
        "test": r.test,
        "temperature_degc": number(r.temperature_degc),
        "repeats": r.repeats,
        "spread": number(from_si(r.spread, unit)),
        "confidence": number(r.confidence),
        "quantile": r.quantile_name,
        "quantile_value": number(r.quantile),
        "half_width": number(from_si(r.half_width, unit)),
        "needed_half_width": number(from_si(r.needed_half_width, unit)),
        "unit": unit,
        "bound_by": r.bound_by,
    }


def _genetic(genetic: GeneticPlan, plan: Plan) -> Mapping[str, Any]:
    units = {a.error: a.unit for a in plan.allowances}
    return {
        "time_s": number(genetic.time_s),
        "gap": number(genetic.gap),
        "generations": genetic.history.generations,
        "evaluations": genetic.history.evaluations,
        "stopped": genetic.history.stopped,
        "front": [
            {k: number(v if k == "time_s" else from_si(v, units[k])) for k, v in point.items()}
            for point in genetic.front
        ],
    }
