"""plan.json: the plan as data, in display units (interfaces, section 3)."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from planner.export.header import sealed
from planner.nouns.allowances import Allowance, FlownCovariance
from planner.nouns.choices import RepeatReason, TestVisits
from planner.nouns.plan import Achieved, GeneticPlan, Plan, PlannedBench, PlannedChamber, PlannedTest, Worth
from planner.nouns.step import Step
from planner.units import from_si, unit_factor

# Twelve digits tell every figure apart and hide the rounding of unit conversions (0.002 stays 0.002).
DIGITS = 12
DECIDING = ("numpy", "scipy", "cvxpy", "highspy", "clarabel", "deap", "holidays")
SHORT = 8  # of a covariance


def plan_document(plan: Plan) -> dict[str, Any]:
    """The plan as a tree of plain values, in the order in which plan.json holds them, with its hash."""
    return sealed(_unsealed(plan))


def _unsealed(plan: Plan) -> dict[str, Any]:
    return {
        "planner": plan.version,
        "spec": {"name": plan.name, "sha256": plan.spec_sha256},
        "seed": plan.seed,
        "method": plan.method,
        "temperature_estimator": plan.temperature_estimator,
        **_outcome(plan),
        "benches": {bench.name: _bench(bench) for bench in plan.benches},
        "requirements": [_requirement(r) for r in plan.requirements],
        "families": {
            name: {str(i): number(from_si(x, plan.requirements[i].unit)) for i, x in figures.items()}
            for name, figures in plan.families.items()
        },
        "sensitivities": [_plain(vars(s)) for s in plan.sensitivities],
        "allowances": {a.error: _allowance(a) for a in plan.allowances},
        **({} if plan.covariance is None else {"covariance": _covariance(plan.covariance)}),
        "tests": [_test(t) for t in plan.tests],
        "reasons": [_reason(r, plan) for r in plan.reasons],
        "genetic": None if plan.genetic is None else _genetic(plan.genetic, plan),
        "hours_per_limit": {  # per unit of the requirement
            str(k): number(v * unit_factor(plan.requirements[k].unit)[0])
            for k, v in plan.hours_per_limit.items()
        },
        "spread_factor": number(max(r.spread_factor for r in plan.requirements)),
        "worth": [_worth(w, plan) for w in plan.worth],
        "prices": [_plain(vars(p)) for p in plan.prices],
        "start": plan.start,
        "shifts": [{"opens_s": number(a), "closes_s": number(b)} for a, b in plan.shifts],
        **_dated(plan),
        "savings": [_plain(vars(s)) for s in plan.savings],
        "trade_off": [_plain(vars(p)) for p in plan.trade_off],
        "notes": list(plan.notes),
        "packages": dict(deciding_packages()),
        **({"plugins": [used.document() for used in plan.plugins]} if plan.plugins else {}),
        "steps": [step_document(step) for step in plan.steps],
    }


def _dated(plan: Plan) -> Mapping[str, Any]:
    """The date of the start and the days off, of a plan that has them."""
    if plan.first_day is None:
        return {}
    return {
        "first_day": plan.first_day.isoformat(),
        "shifts_period_s": number(plan.shifts_period_s),
        "days_off": [{"date": day.isoformat(), "name": name} for day, name in plan.days_off],
    }


@cache
def deciding_packages() -> Mapping[str, str]:
    """Package -> version here, of Python and of what decides figures; the same spec may differ by them."""
    from importlib.metadata import PackageNotFoundError, version

    found = {"python": platform.python_version()}
    for name in DECIDING:
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # highspy comes with cvxpy, in some versions
            continue
    return found


def _outcome(plan: Plan) -> Mapping[str, Any]:
    """How long it takes, and what is proved of that."""
    value, bound = number(plan.objective_value), number(plan.objective_bound)
    return {
        "objective": {"minimise": plan.objective, "value_s": value, "bound_s": bound},
        "time_s": number(plan.time_s),
        "bound_s": number(plan.bound_s),
        "gap": number(plan.gap),
        "proved": plan.proved,
        "proved_of": plan.proved_of,
        "power_on_s": number(plan.power_on_s),
    }


def plan_text(plan: Plan) -> str:
    """plan.json; one line a step, so that a diff of two plans reads like a list of changes."""
    return document_text(plan_document(plan))


def document_text(document: Mapping[str, Any]) -> str:
    """plan.json of a plan's tree, as `plan_text` writes it."""
    steps = document["steps"]
    document = {key: value for key, value in document.items() if key != "steps"}
    head = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    lines = ",\n  ".join(json.dumps(s, ensure_ascii=False, allow_nan=False) for s in steps)
    return f'{head[:-2]},\n "steps": [\n  {lines}\n ]\n}}\n'


def step_document(step: Step) -> dict[str, Any]:
    """One step with every key of the interfaces; the chamber's rate where it moves at one."""
    found = dict(_plain(vars(step)))
    if found["temperature_rate_degc_min"] is None:
        del found["temperature_rate_degc_min"]
    return found


def _plain(value: Any) -> Any:
    """Records' fields as JSON has them, figures rounded."""
    if isinstance(value, float):
        return number(value)
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, tuple) else value


def number(value: float) -> float | int:
    """A figure rounded to DIGITS digits; whole figures stay whole."""
    rounded = float(f"{value:.{DIGITS}g}")
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e15 else rounded


def _covariance(c: FlownCovariance) -> Mapping[str, Any]:
    """Beside the allowances: what goes between the errors, in the product of their units."""
    return {
        "requirement": c.requirement,
        "terms": [_plain(vars(t)) for t in c.terms],
        "matrix": [[number(float(f"{x:.{SHORT}g}")) for x in row] for row in c.matrix],
    }


def _test(t: PlannedTest) -> Mapping[str, Any]:
    said = {name: getattr(t, name) for name in ("test", "bench", "calibrates", "motions", "attended")}
    return {name: _plain(value) for name, value in {**said, **vars(t)}.items()}


def _bench(b: PlannedBench) -> Mapping[str, Any]:
    return {
        "kind": b.kind,
        "axes": b.axes,
        "units": b.units,
        "room_degc": number(b.room_degc),
        "arm_m": _optional(b.arm, "m"),
        "limits": {
            "rate_dps": _optional(b.rate, "deg/s"),
            "angular_acceleration_dps2": _optional(b.angular_acceleration, "deg/s^2"),
            "acceleration_g": _optional(b.acceleration, "g"),
            "travel_deg": {str(k): [number(from_si(x, "deg")) for x in v] for k, v in b.travel.items()},
        },
        "chamber": None if b.chamber is None else _chamber(b.chamber),
    }


def _chamber(c: PlannedChamber) -> Mapping[str, Any]:
    return {
        "coldest_degc": number(c.coldest_degc),
        "hottest_degc": number(c.hottest_degc),
        "heating_k_per_min": _optional(c.heating, "K/min"),
        "cooling_k_per_min": _optional(c.cooling, "K/min"),
        "soak_s": number(c.soak_s),
    }


def _optional(value: float | None, unit: str) -> float | int | None:
    return None if value is None else number(from_si(value, unit))


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
        **(_by_information(r) if r.family else {}),
    }


def _by_information(r: Achieved) -> Mapping[str, Any]:
    return {"family": r.family, "temperature": r.temperature, "spread_factor": number(r.spread_factor)}


def _allowance(a: Allowance) -> Mapping[str, Any]:
    return {
        "allowed": number(from_si(a.allowed, a.unit)),
        "unit": a.unit,
        "calibrated": a.calibrated,
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


def _worth(w: Worth, plan: Plan) -> Mapping[str, Any]:
    def figures(values: Sequence[float]) -> dict[str, float | None]:
        """By requirement, display units; null where nothing bounds it."""
        pairs = zip(values, plan.requirements, strict=True)
        return {
            str(i): number(from_si(v, r.unit)) if math.isfinite(v) else None for i, (v, r) in enumerate(pairs)
        }

    return {
        "test": w.test,
        "temperature_degc": number(w.temperature_degc),
        "repeats": w.repeats,
        "time_s": number(w.time_s),
        "repeat_s": number(w.repeat_s),
        "without": figures(w.without),
        "one_fewer": figures(w.one_fewer),
        "one_more": figures(w.one_more),
    }


def _of_front(key: str, value: float, plan: Plan) -> float:
    """Seconds, the figure of a requirement by its index, or the allowance of an error, in display units."""
    if key in ("time_s", "power_on_s"):
        return value
    if key.isdigit():
        return from_si(value, plan.requirements[int(key)].unit)
    return from_si(value, next(a.unit for a in plan.allowances if a.error == key))


def _visit(v: TestVisits) -> Mapping[str, Any]:
    return {
        "test": v.test,
        "temperatures_degc": [number(t) for t in v.temperatures_degc],
        "repeats": list(v.repeats),
    }


def _genetic(genetic: GeneticPlan, plan: Plan) -> Mapping[str, Any]:
    return {
        "time_s": number(genetic.time_s),
        "gap": number(genetic.gap),
        "generations": genetic.history.generations,
        "evaluations": genetic.history.evaluations,
        "stopped": genetic.history.stopped,
        "front": [{k: number(_of_front(k, v, plan)) for k, v in point.items()} for point in genetic.front],
        "campaigns": [[_visit(v) for v in campaign] for campaign in genetic.campaigns],
    }
