"""On which conditions an effect's regressors depend: asked of the effect, one condition moved at a time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from typing import get_args

import numpy as np

from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Effect, Sensor

CONDITIONS: tuple[Condition, ...] = get_args(Condition)
IN_USE_DEGC = (-60.0, 85.0)
_SEED = 20_261  # any rows will do, the same every time


def random_conditions(
    rng: np.random.Generator, n: int, degc: tuple[float, float] = IN_USE_DEGC
) -> Conditions:
    """n rows over all that a bench and a flight can be: rests on faces of a cube among turns under load.

    rate within ±10 rad/s, a third of the rows at rest; force within ±800 m/s², half of the rows at 1 g along
    an axis; temperature_degc within `degc`; temperature_rate within ±0.1 K/s; two hours; a year
    """
    faces = 9.8 * np.concatenate([np.eye(3), -np.eye(3)])[rng.integers(0, 6, n)]
    loaded = rng.uniform(-800.0, 800.0, (n, 3))
    return Conditions(
        rate=np.where(rng.random((n, 1)) < 1 / 3, 0.0, rng.uniform(-10.0, 10.0, (n, 3))),
        specific_force=np.where(rng.random((n, 1)) < 0.5, faces, loaded),
        temperature_degc=rng.uniform(*degc, n),
        temperature_rate=rng.uniform(-0.1, 0.1, n),
        time_on=rng.uniform(0.0, 7200.0, n),
        day=rng.uniform(0.0, 365.0, n),
    )


def moved(here: Conditions, there: Conditions, names: Iterable[Condition]) -> Conditions:
    """`here` with some conditions as they are there."""
    return replace(here, **{name: getattr(there, name) for name in names})


def depends_on(
    effect: Effect, sensor: Sensor, condition: Condition, nonlinear: Mapping[str, float] | None = None
) -> bool:
    """Whether the regressors change on some of a thousand rows when this condition alone does."""
    here, there = _probes()
    before = effect.regressors(sensor, here, nonlinear)
    return not np.array_equal(before, effect.regressors(sensor, moved(here, there, [condition]), nonlinear))


@cache
def _probes() -> tuple[Conditions, Conditions]:
    rng = np.random.default_rng(_SEED)
    return random_conditions(rng, 1000), random_conditions(rng, 1000)
