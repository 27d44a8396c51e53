"""Which coefficients of the budgeted errors act on which channel, asked of the effects themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from planner import catalog
from planner.protocols import SENSORS, Effect, Sensor
from planner.records import Array, Conditions, ErrorModel
from planner.sensor import ErrorName

_PROBES = 6


@dataclass(frozen=True)
class ChannelTerm:
    """One coefficient on one channel: `gyro.scale_factor`, its term's name and its index."""

    error: str
    effect: str
    term: str
    index: int


@lru_cache(maxsize=64)
def acts_on(name: str, sensor: Sensor, channel: int) -> tuple[int, ...]:
    """Indices of an effect's terms that act on a channel of a sensor under some rates and forces.

    None for an effect that changes with temperature, time or day as well: records of one repeat, at one
    temperature and within the hour, do not show it.
    """
    effect = catalog.effects()[name]
    if sensor not in effect.sensors or not _moved_by_motion_alone(name, sensor):
        return ()
    columns = effect.regressors(sensor, probe())[:, channel]
    return tuple(int(i) for i in np.flatnonzero(np.any(columns != 0.0, axis=0)))


@lru_cache(maxsize=64)
def _moved_by_motion_alone(name: str, sensor: Sensor) -> bool:
    effect, here = catalog.effects()[name], probe()
    other = replace(
        here,
        temperature_degc=here.temperature_degc + 40.0,
        temperature_rate=here.temperature_rate + 0.05,
        time_on=here.time_on + 1000.0,
        day=here.day + 30.0,
    )
    return bool(np.array_equal(effect.regressors(sensor, here), effect.regressors(sensor, other)))


def probe() -> Conditions:
    """Turns and loads about no axis of the body, and a rest on every face."""
    rng = np.random.default_rng(0)  # any motion will do, the same every time
    rate = np.concatenate([rng.normal(size=(_PROBES, 3)), np.zeros((6, 3))])
    faces = 9.8 * np.concatenate([np.eye(3), -np.eye(3)])
    force = np.concatenate([30.0 * rng.normal(size=(_PROBES, 3)), faces])
    n = len(rate)
    return Conditions(rate, force, np.full(n, 20.0), np.zeros(n), np.full(n, 60.0), np.zeros(n))


def terms_on(sensor: Sensor, channel: int, models: Sequence[ErrorModel]) -> list[ChannelTerm]:
    """Every coefficient of these errors that acts on the channel."""
    return [
        ChannelTerm(model.name, effect.name, effect.terms(sensor)[i].name, i)
        for model in models
        if ErrorName(model.name).sensor == sensor
        for effect in [_effect(model)]
        for i in acts_on(effect.name, sensor, channel)
    ]


def _effect(model: ErrorModel) -> Effect:
    found: Effect = catalog.effects()[ErrorName(model.name).effect]
    return found


def columns_of(sensor: Sensor, channel: int, terms: Sequence[ChannelTerm], conditions: Conditions) -> Array:
    """(n, k) SI output on the channel per SI unit of each coefficient."""
    found = {t.effect: catalog.effects()[t.effect].regressors(sensor, conditions) for t in terms}
    return np.array([found[t.effect][:, channel, t.index] for t in terms]).T.reshape(
        len(conditions.day), len(terms)
    )


def channels() -> list[tuple[Sensor, int]]:
    """The six channels of a unit."""
    return [(sensor, channel) for sensor in SENSORS for channel in range(3)]
