"""The declared error model of one channel over the rows of a campaign: its effects, their tables, the nodes.

An effect that changes over temperature and is `tabled` is no coefficient of its own: the table of the effect
whose temperature it is carries it, with a node at every temperature of the campaign that tells it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner import catalog
from planner.measurement import ENTRIES, Carried, ChannelModel, entering, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Effect, Sensor
from planner.temperature_table import nodes_with_rows, temperature_nodes

EXCITED = 0.05  # share of the largest input, or the input itself (rad/s, m/s²), that shows a scale factor
EXCITING = {"gyro": 0.09, "accelerometer": 4.9}


def channel_model(
    sensor: Sensor, channel: int, conditions: Conditions, effects: Sequence[str]
) -> ChannelModel:
    """The model of one channel with the declared effects that act on it."""
    known = catalog.effects()
    mine = [known[name] for name in effects if sensor in known[name].sensors]
    tabled = {e.temperature_of for e in mine if e.tabled}
    names = dict.fromkeys(e.temperature_of if e.tabled and e.temperature_of else e.name for e in mine)
    nodes = temperature_nodes(conditions.temperature_degc)
    found = [
        _carried(known[name], sensor, channel, conditions, nodes if name in tabled else None)
        for name in names
        if sensor in known[name].sensors
    ]
    acting = [c for c in found if c.terms]
    ordered = tuple(c for entry in ENTRIES for c in acting if entering(c.effect) == entry)
    return ChannelModel(sensor, channel, conditions, ordered)


def _carried(
    effect: Effect, sensor: Sensor, channel: int, conditions: Conditions, nodes: Array | None
) -> Carried:
    terms = tuple(i for i, t in enumerate(effect.terms(sensor)) if channel in t.channels)
    if nodes is not None and effect.group == "scale_factor":
        u = np.abs(sensed(sensor, conditions)[:, channel])
        driven = u >= min(EXCITED * u.max(initial=0.0), EXCITING[sensor])
        nodes = nodes_with_rows(nodes, conditions.temperature_degc[driven])
    return Carried(effect, terms, nodes)
