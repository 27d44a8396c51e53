"""The effects that a spec does not declare, as blocks of columns on the channels of one sensor.

Terms that act on one channel each make a block of their own per channel; terms that several channels share
(one Earth, one arm) make one block over all of them. An effect with a nonlinear parameter is a block for
every value of a grid: it exists only under the alternative, so the grid belongs into the test.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner import catalog
from planner.learn.diagnosis.channels import Channel, columns
from planner.learn.diagnosis.generic import generics
from planner.learn.diagnosis.orthogonal import clear, orthonormal
from planner.measured import DwellTable
from planner.protocols import Effect, Sensor
from planner.records import Array
from planner.temperature_table import hats, temperature_nodes

GRID = 8  # values of a nonlinear parameter; neighbours then share more than 95 % of what they explain
OF_THE_DAYS = ("ageing", "bias_step")
LEAST_DAYS = 2.0
UNSEEN = 1e-12  # of a column's square that the largest entry is, below which it is rounding


@dataclass(frozen=True)
class Block:
    """Columns that enter or stay out together.

    name: the effect, or the variable of a generic alternative; terms: one for each column, "" for a column
        that only bends a table over temperature
    columns: channel's index -> (n, k), zero where a shared term does not act on that channel
    """

    name: str
    sensor: Sensor
    columns: Mapping[int, Array]
    terms: tuple[str, ...]
    nonlinear: Mapping[str, float] = field(default_factory=dict)
    generic: bool = False

    @property
    def channels(self) -> tuple[int, ...]:
        """Indices of the channels on which it acts."""
        return tuple(self.columns)

    @property
    def key(self) -> tuple[str, tuple[int, ...]]:
        """The same for all values of a nonlinear parameter."""
        return self.name, self.channels


def library_blocks(
    channels: Sequence[Channel], table: DwellTable, declared: Sequence[str], sensor: Sensor
) -> list[Block]:
    """Every block of every effect of the library that is not declared and exists on the sensor."""
    mine = [c for c in channels if c.sensor == sensor]
    found: list[Block] = []
    for name, effect in catalog.effects().items():
        if name not in declared and sensor in effect.sensors and lasts(name, table):
            for nonlinear in grid(effect, table):
                found += effect_blocks(mine, name, nonlinear)
    return found


def lasts(name: str, table: DwellTable) -> bool:
    """Whether the table spans enough days for an effect of the days; within two it is the run-to-run."""
    return name not in OF_THE_DAYS or float(np.ptp(table.day)) >= LEAST_DAYS


def effect_blocks(channels: Sequence[Channel], name: str, nonlinear: Mapping[str, float]) -> list[Block]:
    """The blocks of one effect at one value of its nonlinear parameters, on the channels of one sensor."""
    effect = catalog.effects()[name]
    if not channels:
        return []
    sensor = channels[0].sensor
    names = [t.name for t in effect.terms(sensor)]
    full = {c.axis: columns(c, name, dict(nonlinear)) for c in channels}
    acts = {axis: np.sum(a * a, axis=0) > UNSEEN for axis, a in full.items()}
    count = sum(a.astype(int) for a in acts.values())
    if np.any(count > 1):
        keep = np.flatnonzero(count > 0)
        terms = tuple(names[k] for k in keep)
        return [Block(name, sensor, {axis: a[:, keep] for axis, a in full.items()}, terms, nonlinear)]
    return [
        _bent(c, Block(name, sensor, {c.axis: full[c.axis][:, mine]}, tuple(np.array(names)[mine].tolist()),
                       nonlinear))
        for c in channels
        if (mine := acts[c.axis]).any()
    ]  # fmt: skip


def _bent(c: Channel, block: Block) -> Block:
    """A temperature effect as it is calibrated: a table over the data's temperatures, not only a slope.

    The table's bends are clear of a straight line, so that the effect's coefficient is the mean slope.
    """
    driven = {"bias_temperature": np.ones(len(c.r)), "scale_factor_temperature": c.u}.get(block.name)
    t = c.model.conditions.temperature_degc
    nodes = temperature_nodes(t)
    if driven is None or len(nodes) < 3:
        return block
    line = np.column_stack([driven, block.columns[c.axis]])
    table = clear(orthonormal(line), hats(t, nodes, 0.0)[:, 1:-1] * driven[:, None])
    terms = (*block.terms, *([""] * table.shape[1]))
    return replace(block, columns={c.axis: np.column_stack([block.columns[c.axis], table])}, terms=terms)


def generic_blocks(channels: Sequence[Channel], table: DwellTable, sensor: Sensor) -> list[Block]:
    """Every generic alternative on every channel of the sensor."""
    return [
        Block(g.varies_with, sensor, {c.axis: g.columns}, (), generic=True)
        for c in channels
        if c.sensor == sensor
        for g in generics(c, table)
    ]


def grid(effect: Effect, table: DwellTable) -> list[dict[str, float]]:
    """Values of the effect's nonlinear parameters that the table can tell apart; one empty one for none."""
    if not effect.nonlinear:
        return [{}]
    (name,) = effect.nonlinear
    return [{name: float(v)} for v in _values(name, effect, table)]


def _values(name: str, effect: Effect, table: DwellTable) -> Array:
    if name == "day":
        return _between(table.day)
    low, high = seen_time_constants(table)
    if not np.isfinite(low):
        return np.array([effect.nonlinear[name]])
    return np.geomspace(low, high, GRID)


def seen_time_constants(table: DwellTable) -> tuple[float, float]:
    """The time constants that the records can show, s: two records of a run feel the shortest."""
    same = np.diff(table.run) == 0
    gaps = np.diff(table.time_on)[same]
    gap = float(np.median(gaps[gaps > 0])) if (gaps > 0).any() else 0.0
    low = max(20.0, float(np.min(table.time_on, initial=np.inf)), gap / 2.0)
    return low, max(3.0 * float(np.max(table.time_on, initial=0.0)), 2.0 * low)


def _between(day: Array) -> Array:
    """Middles between the days of the table, thinned to 16."""
    middles = middles_of_days(day)
    if len(middles) == 0:
        return day[:1] if len(day) else np.zeros(1)
    kept = np.linspace(0, len(middles) - 1, min(len(middles), 16)).round().astype(int)
    return np.asarray(middles[np.unique(kept)])


def middles_of_days(day: Array) -> Array:
    """(k,) every day of a step that the table's days can tell from others."""
    days = np.unique(np.round(day, 3))
    return np.asarray((days[1:] + days[:-1]) / 2.0)
