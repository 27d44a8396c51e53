"""The plan counted again from plan.json and the spec alone: nothing here comes from `planner.plan`.

Each check compares figures one by one and keeps every fault with its place. What a search found on the way
(the genetic algorithm's history, prices of limits, savings) cannot be counted again without searching again;
it is named as such.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from typing import Any

from planner.nouns.trajectory import Trajectory
from planner.protocols import SENSORS
from planner.quantities import DAY_S, WEEKDAYS
from planner.spec.days_off import days_off, first_monday
from planner.spec.load import LoadedSpec
from planner.spec.model import Spec
from planner.spec.plan_choice import Objective
from planner.units import from_si
from planner.verify.findings import Check, Document, Fault, Findings
from planner.verify.recount_budget import budgets_of, check_budget, check_unit_said, made_by_hand
from planner.verify.recount_hours import start_of, windows_of
from planner.verify.recount_loads import loads_of
from planner.verify.recount_navigation import check_navigation
from planner.verify.recount_search import check_front, check_keys, check_prices
from planner.verify.recount_steps import check_steps

NOT_RECOUNTED = (
    "genetic: a search's history; that no other campaigns are better than those of its front",
    "hours_per_limit (but for keys and signs), savings, trade_off, prices, worth: other plans, to be planned "
    "again",
    "bound_s: that no plan is shorter is proved by the search, not by counting",
    "notes, proved_of: words",
    "packages: versions where it was planned; planner reproduce compares them with those here",
)


def is_by_information(document: Document) -> bool:
    """Whether a plan says that it promises what will be flown; others are by half-widths and sums."""
    return document.get("method") == "information"


@dataclass(frozen=True)
class Recount:
    """Every check, every fault, and what was not counted again."""

    checks: tuple[Check, ...]
    faults: tuple[Fault, ...]
    not_recounted: tuple[str, ...] = NOT_RECOUNTED

    def and_also(self, found: Sequence[Findings]) -> Recount:
        """With more checks."""
        return replace(
            self,
            checks=(*self.checks, *(f.check() for f in found)),
            faults=(*self.faults, *(fault for f in found for fault in f.faults)),
        )

    @property
    def ok(self) -> bool:
        """Whether nothing was found."""
        return not self.faults

    @property
    def figures(self) -> int:
        """How many figures were compared."""
        return sum(check.figures for check in self.checks)


def recount(document: Document, loaded: LoadedSpec, trajectory: Trajectory | None = None) -> Recount:
    """Count a plan's tree (plan.json) again. trajectory: the spec's flight, unless sensitivities are given.

    A tree of another shape than planner's is a fault of its own, and nothing else can be counted then. What a
    plan by information promises is recount_promise's.
    """
    seal = _check_seal(document)
    shape = _check_shape(document)
    found = [seal, shape]
    if not shape.faults:
        spec = loaded.spec
        found += [check_keys(document), check_front(document), check_prices(document)]
        found += [_check_origin(document, loaded), _check_benches(document, spec)]
        names = _check_names(document, spec)
        found.append(names)
        if not names.faults:
            found.append(_check_bound(document, spec))
            found += check_steps(document, spec)
            found += check_budget(document, spec, is_by_information(document))
            found += check_navigation(document, spec, trajectory, is_by_information(document))
            found.append(_check_genetic(document, spec))
            found.append(_check_spreads(document, spec))
    return Recount(tuple(f.check() for f in found), tuple(fault for f in found for fault in f.faults))


def _check_seal(document: Document) -> Findings:
    """SHA-256 of the canonical JSON without the seal itself."""
    found = Findings("seal", "the plan is as planner wrote it: its content has the hash that it carries")
    inside = {k: v for k, v in document.items() if k not in ("plan_sha256", "$schema", "path")}
    try:
        text = json.dumps(inside, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    except ValueError as error:
        found.fault("plan_sha256", f"cannot be taken: {error}")
        return found
    found.same("plan_sha256", document.get("plan_sha256"), hashlib.sha256(text.encode()).hexdigest())
    return found


def _check_shape(document: Document) -> Findings:
    """Every key and type of plan.json."""
    found = Findings("shape", "every key of plan.json is there, with the type it must have")
    for key, kind in _SHAPE.items():
        value = document.get(key)
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            found.fault(key, "is missing or of the wrong type")
        else:
            found.figures += 1
    if not found.faults:
        _check_rows(found, document)
    return found


NUMBER = (int, float)
_SHAPE: Mapping[str, Any] = {
    "planner": str,
    "spec": dict,
    "seed": int,
    "objective": dict,
    "time_s": NUMBER,
    "bound_s": NUMBER,
    "gap": NUMBER,
    "proved": bool,
    "power_on_s": NUMBER,
    "benches": dict,
    "requirements": list,
    "sensitivities": list,
    "allowances": dict,
    "tests": list,
    "reasons": list,
    "steps": list,
    "shifts": list,
}
_ROWS: Mapping[str, Mapping[str, Any]] = {
    "steps": {
        "id": str,
        "bench": str,
        "action": str,
        "start_s": NUMBER,
        "end_s": NUMBER,
        "test": (str, type(None)),
        "temperature_degc": (*NUMBER, type(None)),
        "repeat": (int, type(None)),
        "motion": (dict, type(None)),
        "units": int,
        "attended": bool,
    },
    "tests": {
        "test": str,
        "bench": str,
        "calibrates": list,
        "motions": int,
        "attended": bool,
        "temperatures_degc": list,
        "repeats": list,
        "time_s": NUMBER,
        "power_on_s": NUMBER,
    },
    "reasons": {
        "error": str,
        "test": str,
        "temperature_degc": NUMBER,
        "repeats": int,
        "spread": NUMBER,
        "confidence": NUMBER,
        "quantile": str,
        "quantile_value": NUMBER,
        "half_width": NUMBER,
        "needed_half_width": NUMBER,
        "unit": str,
        "bound_by": str,
    },
    "requirements": {
        "error": str,
        "at": str,
        "rule": str,
        "limit": NUMBER,
        "achieved": NUMBER,
        "unit": str,
        "met": bool,
        "shares": dict,
    },
    "sensitivities": {"error": str, "axis": str, "value": NUMBER, "unit": str, "requirement": int},
}


def _check_rows(found: Findings, document: Document) -> None:
    for name, keys in _ROWS.items():
        for i, row in enumerate(document[name]):
            if not isinstance(row, dict) or not keys.keys() <= row.keys():
                found.fault(f"{name} {i}", f"must have {', '.join(keys)}")
                continue
            for key, kind in keys.items():
                if not isinstance(row[key], kind) or (isinstance(row[key], bool) and kind is not bool):
                    found.fault(f"{name} {i}, {key}", "is of the wrong type")
    for name, a in document["allowances"].items():
        parts = a.get("parts") if isinstance(a, dict) else None
        if not isinstance(parts, dict) or set(parts) != set(_PARTS):
            found.fault(f"allowances, {name}", f"must have the parts {', '.join(_PARTS)}")
        elif not all(
            isinstance(v, NUMBER) and not isinstance(v, bool) for v in [a.get("allowed"), *parts.values()]
        ):
            found.fault(f"allowances, {name}", "must be numbers")


_PARTS = ("run_to_run", "in_run", "storage", "temperature", "estimate")


def _check_origin(document: Document, loaded: LoadedSpec) -> Findings:
    found = Findings("spec", "the plan is of this spec: name, SHA-256, seed, start and shifts")
    spec = loaded.spec
    found.same("spec, sha256", document["spec"].get("sha256"), loaded.sha256)
    found.same("spec, name", document["spec"].get("name"), spec.name)
    found.same("seed", document["seed"], spec.plan.seed)
    if "method" in document:  # plans of before have none: they are by the published one
        found.same("method", document["method"], spec.planned_by)
    said = document.get("temperature_estimator", "lines")  # plans of before knew no other
    found.same("temperature_estimator", said, spec.plan.temperature_estimator)
    if not is_by_information(document):
        found.same("families", document.get("families", {}), {})
    found.same("objective, minimise", document["objective"].get("minimise"), _minimised(spec))
    start = None
    if spec.plan.shifts:
        day, rest = divmod(start_of(spec), DAY_S)
        start = f"{WEEKDAYS[int(day)]} {int(rest // 3600):02d}:{int(rest % 3600 // 60):02d}"
    found.same("start", document.get("start"), start)
    shifts = [{"opens_s": a, "closes_s": b} for a, b in windows_of(spec)] if spec.plan.shifts else []
    off = [{"date": day.isoformat(), "name": name} for day, name in days_off(spec).items()]
    found.same("days_off", document.get("days_off", []), off)
    if (monday := first_monday(spec)) is not None:
        first = monday + timedelta(days=start_of(spec) // DAY_S)
        found.same("first_day", document.get("first_day"), first.isoformat())
    found.same("shifts", document["shifts"], shifts)
    return found


def _check_names(document: Document, spec: Spec) -> Findings:
    """Without these nothing else can be compared."""
    found = Findings("names", "tests and benches of the plan are the spec's; every test is planned once")
    names = [t["test"] for t in document["tests"]]
    for name in names:
        if name not in spec.tests:
            found.fault("tests", f"the spec has no test {name}")
        elif names.count(name) > 1:
            found.fault("tests", f"{name} is there more than once")
        else:
            found.figures += 1
    for t in document["tests"]:
        figures = [*t["temperatures_degc"], *t["repeats"]]
        if not all(isinstance(x, NUMBER) and not isinstance(x, bool) for x in figures) or not t["repeats"]:
            found.fault(f"tests, {t['test']}", "temperatures and repeats must be numbers, and some")
        elif t["bench"] not in spec.benches:
            found.fault(f"tests, {t['test']}", f"is not made on {t['bench']}")
        elif len(t["repeats"]) != len(t["temperatures_degc"]):
            found.fault(f"tests, {t['test']}", "must have one number of repeats for each temperature")
    errors = budgets_of(spec)
    found.same("allowances", sorted(document["allowances"]), sorted(errors))
    for name, a in document["allowances"].items():
        if name in errors:
            check_unit_said(found, f"allowances, {name}, unit", a.get("unit"), name)
    for i, r in enumerate(document["reasons"]):
        if r["test"] not in spec.tests or r["error"] not in errors:
            found.fault(f"reasons {i}", f"the spec has no {r['test']} or no {r['error']}")
    return found


def weights_of(spec: Spec) -> tuple[float, float]:
    """What a second of the campaign and one of power-on weigh."""
    minimise = spec.plan.minimise
    if isinstance(minimise, Objective):
        return minimise.time, minimise.power_on
    return (1.0, 0.0) if minimise == "time" else (1e-6, 1.0)


def _minimised(spec: Spec) -> str:
    if made_by_hand(spec):
        return "nothing: the plan is made by hand"
    time, power = weights_of(spec)
    if power == 0:
        return "campaign time"
    if time <= 1e-6 * power:
        return "power-on time"
    return f"{time:g} × time + {power:g} × power-on"


def _check_benches(document: Document, spec: Spec) -> Findings:
    found = Findings("benches", "benches, their limits and chambers are the spec's")
    found.same("benches", list(document["benches"]), list(spec.benches))
    for name, bench in spec.benches.items():
        chamber = bench.chamber
        limits = bench.limits
        wanted = {
            "kind": bench.kind or name,
            "axes": bench.axes,
            "units": bench.units,
            "room_degc": spec.plan.temperatures.room,
            "arm_m": bench.arm,
            "limits": {
                "rate_dps": _shown(limits.rate, "deg/s"),
                "angular_acceleration_dps2": _shown(limits.angular_acceleration, "deg/s^2"),
                "acceleration_g": _shown(limits.acceleration, "g"),
                "travel_deg": {
                    str(k): [_shown(a, "deg"), _shown(b, "deg")] for k, (a, b) in limits.travel.items()
                },
            },
            "chamber": None
            if chamber is None
            else {
                "coldest_degc": chamber.range[0],
                "hottest_degc": chamber.range[1],
                "heating_k_per_min": _shown(chamber.heating, "K/min"),
                "cooling_k_per_min": _shown(chamber.cooling, "K/min"),
                "soak_s": chamber.soak,
            },
        }
        for key, value in wanted.items():
            found.same(f"benches, {name}, {key}", document["benches"].get(name, {}).get(key), value)
    return found


def _shown(value: float | None, unit: str) -> float | None:
    return None if value is None else from_si(value, unit)


def _most_loads(document: Document, spec: Spec) -> int:
    return max((len(own) for own in loads_of(document, spec).values()), default=1)


def _check_bound(document: Document, spec: Spec) -> Findings:
    """value and gap follow from time, power-on and bound; nothing beats the proved bound."""
    found = Findings("bound", "bound, value and gap belong together; no plan is shorter than the bound")
    time, power = weights_of(spec)
    value, bound = document["objective"].get("value_s"), document["objective"].get("bound_s")
    if not isinstance(value, NUMBER) or not isinstance(bound, NUMBER):
        found.fault("objective", "has no value and bound")
        return found
    loads = _most_loads(document, spec)
    found.same("objective, value_s", value, time * document["time_s"] + power * document["power_on_s"], 1e-7)
    found.same("bound_s", document["bound_s"], bound)
    found.at_most("objective, bound_s", bound, value, 1e-8)
    gap = max(0.0, value - bound) / value if value > 0 else 0.0
    if abs(document["gap"] - gap) > 1e-8:
        found.fault("gap", f"is {document['gap']:.9g}, value and bound make {gap:.9g}")
    if document["proved"] and gap > (1e-6 if loads == 1 and not spec.plan.shifts else 1e-9):
        found.fault("proved", f"there is a gap of {gap:.3g}")
    if not document["proved"] and gap == 0:
        found.fault("proved", "the bound is reached, which proves the plan")
    return found


def _check_spreads(document: Document, spec: Spec) -> Findings:
    """Figures need no room for spreads that are known; for estimates they need some."""
    found = Findings("spreads", "the factor that figures keep for spreads that are estimates")
    budgets = [b for sensor in SENSORS for b in getattr(spec.unit, sensor).values()]
    largest = document.get("spread_factor", 1.0)
    factors = [r.get("spread_factor", largest) for r in document["requirements"]]
    found.same("spread_factor", largest, max(factors), 0.0)
    known = all(b.power_ons is None or b.run_to_run_largest == 0.0 for b in budgets)
    for i, factor in enumerate(factors):
        if known:
            found.same(f"requirements {i}, spread_factor", factor, 1.0, 0.0)
        else:
            found.at_most(f"requirements {i}, spread_factor", 1.0, factor, 0.0)
    return found


def _check_genetic(document: Document, spec: Spec) -> Findings:
    """The genetic algorithm's gap is that of its time, and its points speak of the plan's errors."""
    found = Findings("genetic", "the genetic algorithm's campaign is no shorter than the exact one")
    genetic = document.get("genetic")
    if genetic is None:
        return found
    _, power = weights_of(spec)
    if power == 0 and _most_loads(document, spec) == 1 and not spec.plan.shifts and document["proved"]:
        found.at_most("genetic, time_s", document["time_s"], genetic["time_s"], 1e-8)
        found.same("genetic, gap", genetic["gap"], genetic["time_s"] / document["time_s"] - 1.0, 1e-6)
    for i, point in enumerate(genetic["front"]):
        for name in point:
            known = name in ("time_s", "power_on_s") or name in document["allowances"]
            if not known and name not in map(str, range(len(document["requirements"]))):
                found.fault(f"genetic, front {i}", f"{name} is no error of the plan")
    return found
