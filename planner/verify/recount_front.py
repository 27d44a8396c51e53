"""The genetic algorithm's campaigns counted again: hours, power-on hours and promise of every point.

Each point says at which temperatures and how often its tests are made. From that and the spec follow the
steps, one load of one unit, and from the steps what is promised (recount_promise). The planner draws curves
of its own for each of them: where a campaign has few temperatures they make nearly all of a figure, and two
draws of a few thousand are then up to 2 % apart (measured on the shipped specs): SAME. Below three
temperatures the planner's 2000 scatter a 95 % quantile by 1.2 % to 1.8 % (one sigma, 16 seeds of a
self-aligned starter), the 4000 here by two thirds of that: APART is three sigma of their difference. What a
quantile here may err by its own draws is counted; the planner draws a quarter of the flights for a point that
is only shown, so that three sigma of the difference are 3 √(1 + 4) of it: SIGMAS.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from itertools import groupby
from typing import Any

from planner.errors import InputError
from planner.spec.curve_names import families_of
from planner.spec.model import NAVIGATION_ERRORS, Spec
from planner.units import unit_factor
from planner.verify.asked_steps import chamber_temperatures, expected
from planner.verify.experiment import Experiment
from planner.verify.findings import Document, Findings
from planner.verify.prediction import DrawnCurves
from planner.verify.records import records_of
from planner.verify.recount import weights_of
from planner.verify.recount_hours import earliest
from planner.verify.recount_loads import used_benches
from planner.verify.recount_promise import NOTHING, as_planned, figures_of

SAME, APART = 0.03, 0.05
SIGMAS = 6.7
FEW = 2  # temperatures, up to which figures may be so far apart
_EXACT = 1e-7


def check_campaigns(document: Document, e: Experiment, curves: DrawnCurves) -> Findings:
    """Every point of a front by information; plans of before do not say what their points are made of.

    e: the plan's own experiment; curves: of the spec
    """
    found = Findings("campaigns", "the genetic algorithm's campaigns last and promise what is said of them")
    genetic = document.get("genetic") or {}
    if "campaigns" not in genetic or e.flight is None:
        return found
    points, campaigns = genetic["front"], genetic["campaigns"]
    if not found.same("genetic, campaigns", len(campaigns), len(points)):
        return found
    for i, (point, campaign) in enumerate(zip(points, campaigns, strict=True)):
        where = f"genetic, front {i}"
        try:
            _check_point(found, where, point, _planned(campaign, e.spec), e, curves)
        except InputError as error:
            found.fault(where, str(error))
    return found


def _planned(campaign: Sequence[Document], spec: Spec) -> Document:
    """A campaign as a plan's `tests` with their steps. Raises InputError for what the spec does not have."""
    tests = []
    for visit in campaign:
        name, degc, repeats = visit["test"], visit["temperatures_degc"], visit["repeats"]
        if name not in spec.tests or len(degc) != len(repeats) or not repeats or min(repeats) < 1:
            raise InputError(f"its campaign makes {name} in a way that the spec does not know")
        tests.append({**visit, "bench": spec.tests[name].bench})
    made: Document = {"tests": tests}
    return {**made, "steps": [*_steps(made, spec)]}


def _steps(planned: Document, spec: Spec) -> Iterator[dict[str, Any]]:
    """One load of one unit on one bench after the other, when people are there."""
    clock = 0.0
    for bench in used_benches(planned, spec):
        every = expected(planned, spec, bench, chamber_temperatures(planned, spec, bench))
        for _, group in groupby(every, key=lambda one: one.block):
            block = [*group]
            clock = earliest(spec, block, clock)
            for one in block:
                step = {k: v for k, v in asdict(one).items() if k not in ("temperature", "seconds", "block")}
                step["temperature_rate_degc_min"] = step.pop("rate")
                times = {"start_s": clock, "end_s": clock + one.seconds}
                yield {**step, **times, "bench": bench, "temperature_degc": one.temperature, "units": 1}
                clock += one.seconds


def _check_point(
    found: Findings, where: str, point: Document, planned: Document, e: Experiment, curves: DrawnCurves
) -> None:
    steps = planned["steps"]
    powered = _powered_s(steps)
    time, power = weights_of(e.spec)
    working = sum(step["end_s"] - step["start_s"] for step in steps)
    found.same(f"{where}, time_s", point["time_s"], time * working + power * powered, _EXACT)
    found.same(f"{where}, power_on_s", point["power_on_s"], powered, _EXACT)
    records = records_of(planned, e.spec)
    own_day = e.flight is not None and e.flight.trajectory.day > 0
    day = e.day if own_day else e.day - e.records.end_day + records.end_day
    prediction = as_planned(replace(e, records=records, day=day), curves)
    assert prediction is not None  # there is a flight
    few = len({degc for test in planned["tests"] for degc in test["temperatures_degc"]}) <= FEW
    for i, wanted in enumerate(e.spec.requirement):
        figure, sigma = max(figures_of(prediction, i, families_of(e.spec)).values())
        factor = unit_factor(NAVIGATION_ERRORS[wanted.error])[0]
        within = max((APART if few else SAME) * figure, SIGMAS * sigma, NOTHING * wanted.limit.si) / factor
        if found.same(f"{where}, requirement {i}", str(i) in point, True):
            found.near(f"{where}, requirement {i}", point[str(i)], figure / factor, within)


def _powered_s(steps: Sequence[Document]) -> float:
    """From every power-on to its power-off."""
    powered = since = 0.0
    for step in steps:
        if step["action"] == "power_on":
            since = step["start_s"]
        elif step["action"] == "power_off":
            powered += step["end_s"] - since
    return powered
