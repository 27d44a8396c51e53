"""Temperatures and repeats of all tests → what the campaign as a whole leaves unobservable.

The steps of the campaign are asked (planner.campaign.observability), not the tests one by one: what one test
leaves open another may close, if it is made at the same temperatures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.campaign.design import design
from planner.campaign.model import Campaign, campaign
from planner.campaign.observability import Unobservable, unobservable
from planner.campaign.power_ons import PowerOns, of_design
from planner.nouns.choices import Campaign as Chosen
from planner.nouns.choices import TestVisits
from planner.nouns.sensor import ErrorName
from planner.plan.by_hand import fixed_repeats
from planner.plan.savings import with_plan
from planner.plan.schedule_to_steps import steps
from planner.spec.model import Given, Spec
from planner.spec.motions import motions_of

ENOUGH = 2  # repeats: more of them make nothing observable that two do not
Visits = tuple[TestVisits, ...]


def unobservable_in(
    spec: Spec,
    visits: Sequence[TestVisits],
    *,
    largest: bool = False,
    without: Sequence[ErrorName] = (),
    beyond: float = 1.0,
    beside: Sequence[ErrorName] = (),
) -> tuple[Unobservable, ...]:
    """What a campaign of these visits leaves unobservable of the errors that the spec's tests calibrate.

    largest: with the most repeats that the spec allows in place of those of the visits
    beyond: times what an error is known to without a calibration, from which on nothing tells it
    beside: further errors to ask for
    """
    asked = (*asked_errors(spec), *beside)
    made = campaign_of(spec, visits, largest=largest) if asked else None
    if made is None:
        return ()
    unknown = tuple(
        e for t in tests_of_unknown_motions(spec) for e in map(ErrorName, spec.tests[t].calibrates)
    )
    return unobservable(made, asked, (*without, *(e for e in unknown if e not in asked)), beyond)


def asked_errors(spec: Spec) -> tuple[ErrorName, ...]:
    """The errors that tests calibrate by motions that are known; none with published coefficients."""
    if isinstance(spec.sensitivities, Given):
        return ()
    unknown = {e for test in tests_of_unknown_motions(spec) for e in spec.tests[test].calibrates}
    every = dict.fromkeys(e for test in spec.tests.values() for e in test.calibrates)
    return tuple(ErrorName(e) for e in every if e not in unknown and ErrorName(e).effect in spec.effects)


def tests_of_unknown_motions(spec: Spec) -> list[str]:
    """Tests on benches of a kind whose motions nobody knows."""
    return [
        name
        for name, test in spec.tests.items()
        if any(motion is None for motion in motions_of(test.bench, spec.benches[test.bench], test))
    ]


def campaign_of(spec: Spec, visits: Sequence[TestVisits], *, largest: bool = False) -> Campaign | None:
    """The campaign that one unit goes through; None without a record whose motions are known."""
    known = [visit for visit in visits if visit.test not in tests_of_unknown_motions(spec)]
    if not any(visit.temperatures_degc for visit in known):
        return None
    alone = with_plan(spec, units=None, shifts=())
    laid = steps(alone, Chosen(tuple(known), (), 0.0, 0.0, False))
    made = design(laid, spec)
    runs = of_design(made, spec)
    if largest:
        tests = {step.id: step.test or "" for step in laid}
        runs = _counted(spec, runs, [tests[str(made.step[start])] for start in runs.starts])
    return campaign(spec, runs)


def _counted(spec: Spec, runs: PowerOns, tests: Sequence[str]) -> PowerOns:
    """Every power-on as often as it stands for: the most repeats where they are free."""
    most = spec.plan.repeats.most / min(ENOUGH, spec.plan.repeats.most)
    counts = np.array([1.0 if fixed_repeats(spec, t) is not None else most for t in tests])
    return replace(runs, counts=counts)
