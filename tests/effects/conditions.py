"""Conditions for the tests of effects."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from planner.nouns.conditions import Conditions


def random_conditions(rng: np.random.Generator, n: int) -> Conditions:
    return Conditions(
        rate=rng.uniform(-10.0, 10.0, (n, 3)),
        specific_force=rng.uniform(-800.0, 800.0, (n, 3)),
        temperature_degc=rng.uniform(-60.0, 85.0, n),
        temperature_rate=rng.uniform(-0.1, 0.1, n),
        time_on=rng.uniform(0.0, 7200.0, n),
        day=rng.uniform(0.0, 365.0, n),
    )


def select(c: Conditions, rows: np.ndarray) -> Conditions:
    return Conditions(
        c.rate[rows],
        c.specific_force[rows],
        c.temperature_degc[rows],
        c.temperature_rate[rows],
        c.time_on[rows],
        c.day[rows],
    )


def one(
    rate: tuple[float, float, float] = (0.0, 0.0, 0.0),
    force: tuple[float, float, float] = (0.0, 0.0, 0.0),
    temperature: float = 20.0,
    temperature_rate: float = 0.0,
    time_on: float = 0.0,
    day: float = 0.0,
) -> Conditions:
    row = [np.array([x], dtype=float) for x in (rate, force, temperature, temperature_rate, time_on, day)]
    return Conditions(*row)


seeds = st.integers(0, 2**32 - 1)
