"""Terms of an effect that no temperature of use reaches: no record need tell them, for no flight reads them.

A drift over temperature and time has a segment from 60 to 80 °C; a unit that is used up to 60 °C has nothing
of it, in its records as in its flights.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from planner import catalog
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import ErrorName
from planner.protocols import Sensor
from planner.spec.model import Spec
from planner.temperature_table import steps_within

APART_K = 5.0  # of the temperatures that are tried: no segment of a table is shorter
PROBES = 16  # turns, loads and times since power-on at each of them
LONGEST_S = 5000.0  # since power-on: K's drift goes on for an hour


def out_of_range(spec: Spec, error: ErrorName) -> frozenset[str]:
    """Names of the terms that are nothing at every temperature of `plan.temperatures.range`."""
    return _nothing(error.sensor, error.effect, *spec.plan.temperatures.range)


@lru_cache(maxsize=256)
def _nothing(sensor: Sensor, name: str, low: float, high: float) -> frozenset[str]:
    effect = catalog.effects()[name]
    if "temperature_degc" not in effect.needs or effect.tabled:
        return frozenset()
    degc = steps_within(low, high, APART_K)
    n, rng = PROBES * len(degc), np.random.default_rng(0)  # any will do, the same every time
    found = effect.regressors(
        sensor,
        Conditions(
            rate=rng.normal(size=(n, 3)),
            specific_force=10.0 * rng.normal(size=(n, 3)),
            temperature_degc=np.repeat(degc, PROBES),
            temperature_rate=rng.normal(size=n) / 60.0,
            time_on=rng.uniform(0.0, LONGEST_S, n),
            day=rng.uniform(0.0, 100.0, n),
        ),
    )
    seen = np.any(found, axis=(0, 1))
    return frozenset(term.name for term, any_ in zip(effect.terms(sensor), seen, strict=True) if not any_)
