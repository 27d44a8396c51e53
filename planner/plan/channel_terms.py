"""Which coefficients of the budgeted errors act on which channel, as the effects themselves say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner import catalog
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import ErrorName
from planner.protocols import SENSORS, Effect, Sensor

MOTION = frozenset(("rate", "specific_force"))


@dataclass(frozen=True)
class ChannelTerm:
    """One coefficient on one channel: `gyro.scale_factor`, its term's name and its index."""

    error: str
    effect: str
    term: str
    index: int


def acts_on(name: str, sensor: Sensor, channel: int) -> tuple[int, ...]:
    """Indices of an effect's terms that act on a channel of a sensor.

    None for an effect that changes with temperature, time or day as well: records of one repeat, at one
    temperature and within the hour, do not show it.
    """
    effect = catalog.effects()[name]
    if sensor not in effect.sensors or not effect.needs <= MOTION:
        return ()
    return tuple(i for i, term in enumerate(effect.terms(sensor)) if channel in term.channels)


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
