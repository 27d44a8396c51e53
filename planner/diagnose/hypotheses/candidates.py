"""The effects that a spec does not declare, as blocks of columns on the channels of one sensor.

Terms that act on one channel each make a block of their own per channel; terms that several channels share
(one Earth, one arm) make one block over all of them. An effect with parameters is a block for every point of
their grid.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.diagnose.channels.channel import Channel, columns, columns_of_all
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.parameters import grid, ranges
from planner.diagnose.references.references import REFERENCES, Reference
from planner.diagnose.shapes.generic import generics
from planner.dwells.dwell_columns import SINGLES
from planner.effects._bench_frame import turning
from planner.effects._history import power_ons
from planner.measurement import reached
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Effect, Sensor, Term
from planner.spec.references import BenchAccuracy
from planner.temperature_table import hats, temperature_nodes

LEAST_DAYS = 1.0  # two sessions a day apart: what differs by less is the run-to-run
LEAST_OF_A_TABLE = 6  # power-ons
SHARED = 0.5  # of the turns, that have a rest in their power-on
READ = 1e-2  # of a temperature or its rate, to which a record's is known
UNSEEN = 1e-12  # of a column's square that the largest entry is, below which it is rounding


@dataclass(frozen=True)
class Block:
    """Columns that enter or stay out together.

    name: the effect, or the variable of a generic alternative; terms: one for each column, "" for a column
        that only bends a table over temperature
    columns: channel's index -> (n, k), zero where a shared term does not act on that channel
    reference: whether it is a hypothesis about a reference; place: where that acts
    stated: what the spec says of each coefficient beforehand, one sigma, SI; 0: nothing
    bounds: the least and the most that each coefficient (k,) can be, SI; None: anything
    apart: whether each of its coefficients may be the only one that is there
    narrow: whether it is a generic one of few columns, or a reference that says so, which the noise is not
        judged under unasked
    """

    name: str
    sensor: Sensor
    columns: Mapping[int, Array]
    terms: tuple[str, ...]
    nonlinear: Mapping[str, float] = field(default_factory=dict)
    generic: bool = False
    reference: bool = False
    place: float = 0.0
    stated: float = 0.0
    bounds: tuple[Array, Array] | None = None
    apart: bool = False
    narrow: bool = False

    @property
    def channels(self) -> tuple[int, ...]:
        """Indices of the channels on which it acts."""
        return tuple(self.columns)

    @property
    def key(self) -> tuple[str, tuple[int, ...]]:
        """The same for all values of its parameters."""
        return self.name, self.channels


def library_blocks(
    channels: Sequence[Channel], table: DwellTable, declared: Sequence[str], sensor: Sensor
) -> list[Block]:
    """Every block of every effect of the library that is not declared and exists on the sensor."""
    mine = [c for c in channels if c.sensor == sensor]
    found: list[Block] = []
    for name, effect in catalog.effects().items():
        if name not in declared and sensor in effect.sensors and lasts(effect, table):
            for nonlinear in grid(ranges(effect, table)) if is_shown(effect, mine) else ():
                found += effect_blocks(mine, name, nonlinear)
    return found


def is_shown(effect: Effect, channels: Sequence[Channel]) -> bool:
    """Whether the records reach where an effect is more than a simpler one, as a table than a line."""
    shows = getattr(effect, "shows", None)
    return shows is None or any(shows(c.sensor, c.model.conditions) for c in channels)


def reference_blocks(
    channels: Sequence[Channel], table: DwellTable, sensor: Sensor, benches: Sequence[BenchAccuracy]
) -> list[Block]:
    """Every hypothesis about a reference, in every place, one block over all channels of the sensor.

    benches: what the spec states of them; the least accurate is what is known beforehand
    """
    mine = [c for c in channels if c.sensor == sensor]
    found = [
        replace(_of_reference(r, mine, table, sensor, place), stated=max(map(r.stated, benches), default=0.0))
        for r in REFERENCES.values()
        if sensor in r.sensors and len(mine) > 1
        for place in r.places(table)
    ]
    return [b for b in found if any(np.any(x) for x in b.columns.values())]


def _of_reference(
    r: Reference, channels: Sequence[Channel], table: DwellTable, sensor: Sensor, place: float
) -> Block:
    columns = {c.axis: r.columns(c, table, place) for c in channels}
    count = next(iter(columns.values())).shape[1]
    terms = _asked(r, columns) or tuple(str(k + 1) for k in range(count))
    bounds = r.bounds(table) if r.bounds is not None else None
    return Block(r.name, sensor, columns, terms, reference=True, place=place, bounds=bounds, narrow=r.narrow)


def _asked(r: Reference, columns: Mapping[int, Array]) -> tuple[str, ...]:
    """The names of its coefficients: of those sets that tell its size the first with the most that act."""
    acts = np.any([np.sum(x**2, axis=0) > UNSEEN for x in columns.values()], axis=0)
    sets = (r.terms, *r.or_else)
    return max(sets, key=lambda names: sum(bool(n) and bool(a) for n, a in zip(names, acts, strict=False)))


def lasts(effect: Effect, table: DwellTable) -> bool:
    """Whether the table spans enough days for an effect of the days; within one it is the run-to-run.

    And power-ons enough for one that is a table itself: within one of them a score of nodes follow any drift.
    And whether it has the columns: without a temperature everything that goes with it looks like its history.
    """
    if any(c.field in effect.needs and c.name in table.absent for c in SINGLES):
        return False
    if follows_any_drift(effect) and len(np.unique(table.run)) < LEAST_OF_A_TABLE:
        return False
    return "day" not in effect.needs or float(np.ptp(table.day)) >= LEAST_DAYS


def follows_any_drift(effect: Effect) -> bool:
    """Whether it is a table of many values over what changes within a power-on: only several tell it."""
    return bool(getattr(effect, "follows_drift", False))


def effect_blocks(channels: Sequence[Channel], name: str, nonlinear: Mapping[str, float]) -> list[Block]:
    """The blocks of one effect at one value of its parameters, on the channels of one sensor."""
    effect = catalog.effects()[name]
    if not channels:
        return []
    sensor = channels[0].sensor
    terms = effect.terms(sensor)
    full = columns_of_all(channels, name, nonlinear)
    acts = {a: _acting(terms, a) & (np.sum(full[a] ** 2, axis=0) > UNSEEN) for a in full}
    if getattr(effect, "nodal", False):
        acts = {c.axis: acts[c.axis] & reached(full[c.axis]) & _left(c, full[c.axis]) for c in channels}
    count = sum(a.astype(int) for a in acts.values())
    if getattr(effect, "history", False) and not effect.parameters:
        apart = [b for c in channels if acts[c.axis].any() for b in _turns_apart(c, effect, full[c.axis])]
    else:
        apart = []
    if np.any(count > 1):
        keep = np.flatnonzero(count > 0)
        names = tuple(terms[k].name for k in keep)
        return [Block(name, sensor, {axis: a[:, keep] for axis, a in full.items()}, names, nonlinear)]
    return [
        *apart,
        *(
            _bent(c, effect, np.flatnonzero(acts[c.axis]), full[c.axis], nonlinear)
            for c in channels
            if acts[c.axis].any()
        ),
    ]


def _left(c: Channel, weights: Array) -> NDArray[np.bool_]:
    """(k,) nodes, of weights (n, k), of which the declared model leaves more than they are read to.

    A node that two ramps at one speed come near, at temperatures that no other record has, is the declared
    table over temperature there: the scatter of the rates, a thousandth of it, gave it −64 ± 58 deg/s.
    """
    left = np.linalg.norm(clear(orthonormal(c.J), weights), axis=0)
    return np.asarray(left > READ * np.linalg.norm(weights, axis=0))


def _turns_apart(c: Channel, effect: Effect, full: Array) -> list[Block]:
    """The effect where the unit rests, and a level of its own in turns: nobody soaks for those from one side.

    None where all records are of one kind, or most turns share a power-on with rests: they share its side.
    """
    turns = turning(c.model.conditions)
    if turns.all() or not turns.any():
        return []
    run = np.cumsum(power_ons(c.model.conditions))
    if np.isin(run[turns], run[~turns]).mean() > SHARED:
        return []
    mine = [k for k, t in enumerate(effect.terms(c.sensor)) if c.axis in t.channels]
    rest = np.where(turns[:, None], 0.0, full[:, mine])
    names = tuple(effect.terms(c.sensor)[k].name for k in mine)
    columns = np.column_stack([rest, turns.astype(float)])
    return [Block(effect.name, c.sensor, {c.axis: columns}, (*names, ""), place=1.0)]


def _acting(terms: Sequence[Term], axis: int) -> NDArray[np.bool_]:
    """(n_terms,) which terms say that they act on a channel."""
    return np.array([axis in t.channels for t in terms], dtype=bool)


def _bent(
    c: Channel, effect: Effect, mine: NDArray[np.int64], full: Array, nonlinear: Mapping[str, float]
) -> Block:
    """One channel's block; an effect that is calibrated as a table bends over the data's temperatures too.

    The table's bends are clear of a straight line, so that the effect's coefficient is the mean slope.
    """
    names = tuple(effect.terms(c.sensor)[k].name for k in mine)
    apart = bool(getattr(effect, "apart", False)) and len(mine) > 1
    plain = Block(effect.name, c.sensor, {c.axis: full[:, mine]}, names, nonlinear, apart=apart)
    if not effect.tabled or effect.temperature_of is None:
        return plain
    t = c.model.conditions.temperature_degc
    nodes = temperature_nodes(t)
    if len(nodes) < 3:
        return plain
    constant = columns(c, effect.temperature_of)[:, mine]
    line = orthonormal(np.column_stack([constant, full[:, mine]]))
    inner = hats(t, nodes, 0.0)[:, 1:-1]
    table = clear(line, np.concatenate([inner * k[:, None] for k in constant.T], axis=1))
    bent = np.column_stack([full[:, mine], table])
    return replace(plain, columns={c.axis: bent}, terms=(*names, *([""] * table.shape[1])))


def generic_blocks(channels: Sequence[Channel], table: DwellTable, sensor: Sensor) -> list[Block]:
    """Every generic alternative on every channel of the sensor."""
    return [
        Block(g.varies_with, sensor, {c.axis: g.columns}, (), generic=True, narrow=g.narrow)
        for c in channels
        if c.sensor == sensor
        for g in generics(c, table)
    ]
