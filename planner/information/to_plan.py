"""The campaign by information → the plan: what is promised, by which family, and what it is made of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from planner.campaign.noise import budget_of
from planner.information.allowed import largest_quantile
from planner.information.borrowed import borrowed_notes
from planner.information.choose import Found
from planner.information.model_of import Flight
from planner.information.parts import Left, left_in_flight, shares
from planner.information.prices import parts_by_share, prices_of
from planner.information.scaled import Part
from planner.information.worth import worth_of
from planner.nouns.allowances import Allowance, ErrorModel, FlownCovariance, FlownTerm
from planner.nouns.choices import RepeatReason
from planner.nouns.deadline import BESIDE
from planner.nouns.plan import Achieved, Plan, Price, Worth
from planner.nouns.sensitivities import Constraint
from planner.nouns.sensor import ErrorName
from planner.plan.by_hand import fixed_repeats, is_hand_made
from planner.plan.campaign_to_plan import (
    idle_benches,
    objective_words,
    rule_name,
    sensitivity_figures,
    worn_out,
)
from planner.plan.confidence import half_widths, quantile, spread_at
from planner.plan.schedule_to_steps import planned_tests
from planner.plan.spec_to_benches import planned_benches
from planner.spec.model import NAVIGATION_ERRORS, Requirement, Spec
from planner.spec.plugins import foreign_plugins
from planner.units import unit_factor

ESTIMATORS = {"lines": "tables with straight lines", "smooth": "smooth tables (posterior mean)"}


def plan_of(
    flight: Flight,
    found: Found,
    models: Sequence[ErrorModel],
    constraints: Sequence[Constraint],
    *,
    version: str,
    sha256: str,
    notes: Sequence[str],
    priced: bool = True,
) -> Plan:
    """Everything that plan.json and the report show of a campaign by information, but the genetic ones.

    priced: with what changes are worth, a quarter of the time, for which campaigns are searched again
    """
    spec = flight.spec
    tests = planned_tests(spec, found.visits, found.timeline)
    left = left_in_flight(flight, found.foreseen, 0)
    allowed = tuple(_allowances(spec, left, models))
    power_on = round(sum(test.power_on_s for test in tests), 6)
    return Plan(
        version=version,
        name=spec.name,
        spec_sha256=sha256,
        seed=spec.plan.seed,
        method="information",
        objective=objective_words(spec),
        requirements=tuple(_achieved(flight, found, i) for i in range(len(spec.requirement))),
        temperature_estimator=spec.plan.temperature_estimator,
        families=_families(spec, found),
        sensitivities=tuple(sensitivity_figures(spec, constraints, allowed)),
        allowances=allowed,
        tests=tests,
        steps=found.timeline,
        reasons=tuple(_reasons(spec, found, models)),
        time_s=round(max((s.end_s for s in found.timeline), default=0.0), 6),
        bound_s=round(found.bound, 6),
        gap=max(0.0, found.cost - found.bound) / found.cost if found.cost else 0.0,
        power_on_s=power_on,
        objective_value=round(found.cost, 6),
        objective_bound=round(found.bound, 6),
        proved=found.proved,
        proved_of=proved_of(found, spec.plan.temperature_estimator),
        hours_per_limit={},
        genetic=None,
        worth=_worth(flight, found),
        covariance=_covariance(left, models),
        prices=_prices(flight, found) if priced else (),
        notes=(*notes, *_notes(flight, found, power_on)),
        benches=planned_benches(spec),
        plugins=foreign_plugins(spec),
    )


def _worth(flight: Flight, found: Found) -> tuple[Worth, ...]:
    """As far as there is time; of what hands made always."""
    late = not is_hand_made(flight.spec) and flight.deadline.over(BESIDE, "the worth of visits")
    return () if late else worth_of(found)


def _prices(flight: Flight, found: Found) -> tuple[Price, ...]:
    """All, if there is time for them: what a search cut short finds is no price. Hands have none."""
    late = flight.deadline.stops(BESIDE, "prices")
    if is_hand_made(flight.spec) or late():
        return ()
    hurried = replace(found, judge=replace(found.judge, late=late))
    prices = prices_of(flight, hurried, _spreads(flight, found))
    return () if late() else prices


def proved_of(found: Found, estimator: Literal["lines", "smooth"]) -> str:
    """Among which campaigns the plan is the shortest, or is said to be within its gap."""
    offers = found.offers
    tests = ", ".join(o.test for o in offers.tests)
    degc = np.unique(offers.degc[offers.soaked])
    grid = (
        f"{len(degc)} candidate temperatures from {degc[0]:g} to {degc[-1]:g} degC" if len(degc) else "room"
    )
    families = ", ".join(found.foreseen.families)
    return (
        f"campaigns of {tests} at {grid}, by working time, under the spec's error model, curves of the "
        f"families {families}, and {ESTIMATORS[estimator]} as estimator"
    )


def _families(spec: Spec, found: Found) -> dict[str, dict[int, float]]:
    return {name: dict(enumerate(figures)) for name, figures in found.foreseen.families.items()}


def _achieved(flight: Flight, found: Found, index: int) -> Achieved:
    wanted = flight.spec.requirement[index]
    value = found.foreseen.largest[index]
    return Achieved(
        error=wanted.error,
        at=wanted.at if isinstance(wanted.at, str) else f"{wanted.at:g} s",
        rule=rule_name(wanted),
        unit=NAVIGATION_ERRORS[wanted.error],
        limit=wanted.limit.si,
        achieved=value,
        met=bool(value * found.spread_factors[index] <= wanted.limit.si * (1.0 + 1e-6)),
        shares=shares(flight, found.foreseen, index),
        family=found.foreseen.binding(index),
        temperature=temperature_words(wanted),
        spread_factor=float(found.spread_factors[index]),
    )


def temperature_words(wanted: Requirement) -> str:
    """`range`, `worst`, `flight`, or the distribution as it is written."""
    if isinstance(wanted.temperature, str):
        return wanted.temperature
    shares_ = wanted.temperature.distribution.items()
    return "{" + ", ".join(f"{t:g} degC: {share:g}" for t, share in sorted(shares_)) + "}"


def _allowances(spec: Spec, left: Left, models: Sequence[ErrorModel]) -> Iterator[Allowance]:
    z = largest_quantile(spec)
    for model in models:
        parts = {name: z * value for name, value in left.parts[ErrorName(model.name)].items()}
        total = float(np.sqrt(sum(value**2 for value in parts.values())))
        yield Allowance(model.name, model.unit, total, **parts, calibrated=model.calibrated)


def _covariance(left: Left, models: Sequence[ErrorModel]) -> FlownCovariance:
    """Of all terms, beside the allowances, at the temperatures of the first requirement."""
    unit_of = {m.name: m.unit for m in models}
    named = [i for i, f in enumerate(left.flying) if str(f.error) in unit_of]
    flying = [left.flying[i] for i in named]
    terms = tuple(FlownTerm(str(f.error), f.term, unit_of[str(f.error)]) for f in flying)
    scale = np.array([1.0 / unit_factor(t.unit)[0] for t in terms])
    matrix = left.covariance[np.ix_(named, named)] * np.outer(scale, scale)
    return FlownCovariance(0, terms, tuple(tuple(map(float, row)) for row in matrix))


def _spreads(flight: Flight, found: Found) -> list[tuple[ErrorName, Part, float]]:
    """Every spread by its share of the requirement that is used most."""
    used = [a / w.limit.si for a, w in zip(found.foreseen.largest, flight.spec.requirement, strict=True)]
    tightest = int(np.argmax(used))
    left = left_in_flight(flight, found.foreseen, tightest)
    return parts_by_share(shares(flight, found.foreseen, tightest), left.parts)


def _reasons(spec: Spec, found: Found, models: Sequence[ErrorModel]) -> Iterator[RepeatReason]:
    """K's half-widths d = t s / √n of the same records, beside ours."""
    plan = spec.plan
    by_name = {model.name: model for model in models}
    for visit in found.visits:
        for error in spec.tests[visit.test].calibrates:
            model = by_name.get(error)
            if model is None or not model.calibrated or not np.isfinite(model.within.get(visit.test, 0.0)):
                continue
            spreads = spread_at(model, visit.temperatures_degc, visit.test)
            widths = half_widths(spec, model, visit.test, visit.temperatures_degc, visit.repeats)
            numbers = quantile(plan.confidence, plan.quantile, np.array(visit.repeats))
            for t, n, s, d, q in zip(
                visit.temperatures_degc, visit.repeats, spreads, widths, numbers, strict=True
            ):
                if not np.isfinite(q):
                    continue  # one power-on has no interval
                yield RepeatReason(
                    error=error,
                    test=visit.test,
                    temperature_degc=t,
                    spread=float(s),
                    confidence=plan.confidence,
                    quantile_name=plan.quantile,
                    quantile=float(q),
                    repeats=n,
                    half_width=float(d),
                    needed_half_width=float(d),
                    bound_by="fixed" if fixed_repeats(spec, visit.test) is not None else "promise",
                )


def _notes(flight: Flight, found: Found, power_on_s: float) -> Iterator[str]:
    """What a person should know of the campaign."""
    spec = flight.spec
    yield from borrowed_notes(spec, found)
    yield from _of_warmth(flight)
    yield from worn_out(spec, power_on_s)
    yield from idle_benches(spec, found.timeline)


def _of_warmth(flight: Flight) -> list[str]:
    """Errors whose share of a limit is no product of what they add per unit along the trajectory."""
    if all(wanted.temperature == "flight" for wanted in flight.spec.requirement):
        return []
    names = {str(flight.response.flying[w.places.start].error) for w in flight.response.warmer}
    budgeted = [name for name in sorted(names) if budget_of(flight.spec.unit, ErrorName(name)) is not None]
    return [
        f"what {name} adds per unit is that at the trajectory's own temperature; the promise counts it "
        "wherever flights start"
        for name in budgeted
    ]
