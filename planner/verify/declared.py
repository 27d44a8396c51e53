"""The declared error model as verify fits it: columns from the effects themselves, the product kept.

    y = v + S(v) k + B b,   v = u + L m

for the channels of one sensor that have coefficients in common, which is one channel unless an effect shares
a term. B, S and L are the regressors of the effects of the groups bias, scale factor and misalignment; an
effect that a table carries gives nodes to the terms of the effect that it changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Effect, Group, Sensor
from planner.verify.nodes import fitted, nodes_of, visited

INPUT: dict[Sensor, Literal["rate", "specific_force"]] = {
    "gyro": "rate",
    "accelerometer": "specific_force",
}
GROUPS: tuple[Group, ...] = ("bias", "scale_factor", "misalignment")
EXCITED = 0.05  # share of the largest input that shows what is proportional to it, or:
NEAR = 0.1  # weight of a node, of an effect that is a table, in the record that comes nearest to it
EXCITING: dict[Sensor, float] = {"gyro": 0.09, "accelerometer": 4.9}  # rad/s, m/s²


def sensed(sensor: Sensor, conditions: Conditions) -> Array:
    """(n, 3) the input of the sensor."""
    found: Array = getattr(conditions, INPUT[sensor])
    return found


def driven_by(effect: Effect, sensor: Sensor, conditions: Conditions) -> Array:
    """(n, 3, terms) regressors of records; of what is linear in the force they are those of its mean."""
    linear = getattr(effect, "linear_in_force", False)  # one that says nothing is averaged
    return effect.regressors(sensor, conditions.means if linear else conditions)


@dataclass(frozen=True)
class Column:
    """One coefficient: effect, its term, the term's index, and the node of its table (NaN: no table)."""

    effect: str
    term: str
    index: int
    node_degc: float = float("nan")


@dataclass(frozen=True)
class Declared:
    """The model of some channels of one sensor. bias, scale, misalignment: its columns in the order of θ."""

    sensor: Sensor
    channels: tuple[int, ...]
    bias: tuple[Column, ...]
    scale: tuple[Column, ...]
    misalignment: tuple[Column, ...]

    @property
    def columns(self) -> tuple[Column, ...]:
        """All coefficients."""
        return (*self.bias, *self.scale, *self.misalignment)

    def matrix(self, columns: Sequence[Column], conditions: Conditions) -> Array:
        """(n, c, p) output of some columns on the channels, SI per SI unit."""
        parts = [np.empty((len(conditions.day), len(self.channels), 0))]
        known = {name: catalog.effects()[name] for name in dict.fromkeys(c.effect for c in columns)}
        driven = {name: driven_by(effect, self.sensor, conditions) for name, effect in known.items()}
        for effect, index in dict.fromkeys((c.effect, c.index) for c in columns):
            own = driven[effect][:, self.channels, index]
            if getattr(known[effect], "nodal", False) and np.abs(own).max(initial=0.0) < NEAR:
                own = np.zeros_like(own)  # no record tells it: a soaked chamber's creeping is none
            nodes = np.array([c.node_degc for c in columns if (c.effect, c.index) == (effect, index)])
            if np.isnan(nodes).any():
                parts.append(own[:, :, None])
            else:
                parts.append(own[:, :, None] * fitted(conditions.temperature_degc, nodes)[:, None, :])
        return np.concatenate(parts, axis=2)

    def scaled(self, conditions: Conditions, v: Array) -> Array:
        """S(v) (n, c, p): each channel's scale effects with v (n, c) for its own input."""
        found = np.empty((*v.shape, len(self.scale)))
        for place, channel in enumerate(self.channels):
            driven = sensed(self.sensor, conditions).copy()
            driven[:, channel] = v[:, place]
            changed = replace(conditions, **{INPUT[self.sensor]: driven})
            found[:, place] = self.matrix(self.scale, changed)[:, place]
        return found


def declared(sensor: Sensor, conditions: Conditions, effects: Sequence[str]) -> tuple[Declared, ...]:
    """The declared effects of a sensor over the plan's records, channels with common terms together."""
    known = catalog.effects()
    mine = [known[name] for name in effects if sensor in known[name].sensors]
    tabled = {e.temperature_of for e in mine if e.tabled}
    carriers = {known[e.temperature_of].name if e.tabled and e.temperature_of else e.name: e for e in mine}
    found = []
    for channels in _together([known[name] for name in carriers], sensor):
        by_group: dict[Group, list[Column]] = {group: [] for group in GROUPS}
        for name in carriers:
            for index, term in enumerate(known[name].terms(sensor)):
                if set(term.channels) <= set(channels):
                    nodes = _nodes(known[name], term.channels, sensor, conditions) if name in tabled else None
                    where = [float("nan")] if nodes is None else nodes.tolist()
                    by_group[known[name].group] += [Column(name, term.name, index, t) for t in where]
        found.append(Declared(sensor, channels, *(tuple(by_group[g]) for g in GROUPS)))
    return tuple(found)


def _together(effects: Sequence[Effect], sensor: Sensor) -> list[tuple[int, ...]]:
    """The channels in sets that share no term."""
    sets = [{0}, {1}, {2}]
    for term in (t for e in effects for t in e.terms(sensor)):
        touched = [s for s in sets if s & set(term.channels)]
        sets = [s for s in sets if s not in touched] + [set().union(*touched)]
    return sorted(tuple(sorted(s)) for s in sets)


def _nodes(effect: Effect, channels: Sequence[int], sensor: Sensor, conditions: Conditions) -> Array:
    """Every temperature of the plan; for what is proportional to the input those where there is some."""
    nodes = nodes_of(conditions.temperature_degc)
    if effect.group != "scale_factor":
        return nodes
    u = np.abs(sensed(sensor, conditions)[:, list(channels)]).max(axis=1)
    driven = u >= min(EXCITED * u.max(initial=0.0), EXCITING[sensor])
    return visited(nodes, conditions.temperature_degc[driven])
