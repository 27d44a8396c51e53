"""An error that no test observes alone → the spread that all tests together give it.

K's half-width q(n) s / √n knows one test. Where only several tests together observe an error, the campaign's
own standard error σ of it stands for s/√n: s = σ √n, n its repeats. A plan made by hand is asked as it is;
for one that is still to be chosen a repeat is one power-on of every test, all at one temperature. s is never
less than the run-to-run of the error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from planner.nouns.allowances import ErrorModel
from planner.nouns.choices import TestVisits
from planner.nouns.sensor import ErrorName
from planner.plan.by_hand import hand_made_visits, is_hand_made
from planner.plan.visits_to_observability import campaign_of
from planner.spec.even_points import even_points
from planner.spec.model import Spec


def with_campaign_spreads(spec: Spec, models: Sequence[ErrorModel]) -> tuple[ErrorModel, ...]:
    """The errors with a finite spread where no test alone has one, but the campaign observes them."""
    alone = [m for m in models if m.calibrated and m.within and np.isinf(min(m.within.values()))]
    if not alone:
        return tuple(models)
    visits = hand_made_visits(spec) if is_hand_made(spec) else _one_repeat(spec)
    sigma = _sigmas(spec, visits)
    return tuple(_together(m, visits, sigma) if m in alone else m for m in models)


def _one_repeat(spec: Spec) -> tuple[TestVisits, ...]:
    middle = even_points(*spec.plan.temperatures.range, 1)
    return tuple(TestVisits(name, middle, (1,)) for name in spec.tests)


def _sigmas(spec: Spec, visits: Sequence[TestVisits]) -> Mapping[str, float]:
    """Error -> its largest standard error, SI, over channels, terms and nodes."""
    made = campaign_of(spec, visits)
    found: dict[str, float] = {}
    for (sensor, _), channel in made.channels.items() if made is not None else ():
        columns = channel.model.columns()[: channel.model.linear]
        for column, sigma in zip(columns, channel.sigma().tolist(), strict=True):
            error = ErrorName.of(sensor, column.effect)
            found[error] = max(found.get(error, 0.0), sigma)
    return found


def _together(model: ErrorModel, visits: Sequence[TestVisits], sigma: Mapping[str, float]) -> ErrorModel:
    """s_run² + within² = n σ²: of the test with the fewest repeats, which has the widest interval."""
    n = min(min(v.repeats) for v in visits if v.test in model.within)
    spread = sigma.get(model.name, np.inf) * np.sqrt(n)
    added = float(np.sqrt(max(spread**2 - model.largest_run_to_run**2, 0.0)))
    return replace(model, within=dict.fromkeys(model.within, added))
