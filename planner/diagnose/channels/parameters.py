"""Values of an effect's parameters that the records can tell apart: their ranges and a grid over them.

Parameters exist only under the alternative, so the grid belongs into the test: a product of few values of
each, evenly spaced on the parameter's own scale. What lies between is for `nonlinear`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Condition, Effect, Parameter

GRID = 8  # values of one parameter; neighbours then share more than 95 % of what they explain
STEPS = 16  # of one that steps
MOST = 64  # values of all parameters together
SHORTEST_S = 20.0  # time constant: no record is shorter
FELT = 3.0  # time constants after which a twentieth is left
RUNS_ALONG: Mapping[str, Condition] = {"s": "time_on", "degc": "temperature_degc", "day": "day"}


@dataclass(frozen=True)
class Range:
    """What a parameter can be. low, high: as a fit carries it

    gaps: (k, 2) of one that steps: the values of its condition between which the rows can tell it
    """

    parameter: Parameter
    low: float
    high: float
    gaps: Array

    @property
    def steps(self) -> Array:
        """(k,) every value that the rows can tell from others: midway in a gap."""
        return np.asarray(self.gaps.mean(axis=1))

    @property
    def step(self) -> float:
        """From one value of the grid to the next, as a fit carries them."""
        return (self.high - self.low) / (GRID - 1)

    def values(self, count: int) -> list[float]:
        """At most `count` values, evenly spaced; the default where the records tell none."""
        p = self.parameter
        if p.stepped:
            kept = np.linspace(0, len(self.steps) - 1, min(len(self.steps), count)).round().astype(int)
            return [float(v) for v in self.steps[np.unique(kept)]] or [p.default]
        if not self.low < self.high:
            return [p.default]
        return [p.value(float(x)) for x in np.linspace(self.low, self.high, count)]


def ranges(effect: Effect, table: DwellTable) -> tuple[Range, ...]:
    """The range of every parameter, narrowed to what the records show of the condition that it lies along."""
    return tuple(_range(p, effect, table) for p in effect.parameters)


def _range(p: Parameter, effect: Effect, table: DwellTable) -> Range:
    along = RUNS_ALONG.get(p.unit.lower())
    low, high = p.low, p.high
    if along in effect.needs:
        seen: Array = getattr(table, along)
        if p.stepped:
            within = table.run if along == "day" else np.arange(len(seen))
            return Range(p, *p.bounds, _gaps(seen, within, low, high))
        times = p.unit == "s" and p.scale == "logarithmic"
        ends = seen_time_constants(table) if times else (float(seen.min()), float(seen.max()))
        if times and p.default < ends[0]:  # over when the second record begins: the first ones tell it
            ends = (float(seen.min()) / FELT, ends[1])
        low, high = max(low, ends[0]), min(high, ends[1])
    if not low < high:  # the records show nothing of the range
        return Range(p, p.carried(p.default), p.carried(p.default), np.empty((0, 2)))
    return Range(p, p.carried(low), p.carried(high), np.empty((0, 2)))


def grid(found: Sequence[Range], most: int = MOST) -> list[dict[str, float]]:
    """Values of the parameters together, no more than `most`; one empty one for none."""
    if not found:
        return [{}]
    each = GRID if len(found) == 1 else max(2, int(most ** (1.0 / len(found)) + 1e-9))
    several = [r.values(STEPS if r.parameter.stepped and len(found) == 1 else each) for r in found]
    every = [dict(zip((r.parameter.name for r in found), v, strict=True)) for v in product(*several)]
    kept = np.unique(np.linspace(0, len(every) - 1, min(len(every), most)).round().astype(int))
    return [every[i] for i in kept]


def seen_time_constants(table: DwellTable) -> tuple[float, float]:
    """The time constants that the records can show, s.

    Of what decays in the shortest a twentieth is left for the first record of a power-on, and from one record
    to the next: a strong one still shows there.
    """
    same = np.diff(table.run) == 0
    gaps = np.diff(table.time_on)[same]
    gap = float(np.median(gaps[gaps > 0])) if (gaps > 0).any() else 0.0
    first = float(np.min(table.time_on, initial=np.inf))
    low = max(SHORTEST_S, first / FELT, gap / FELT)
    return low, max(3.0 * float(np.max(table.time_on, initial=0.0)), 2.0 * low)


def _gaps(condition: Array, run: NDArray[np.int64], low: float, high: float) -> Array:
    """(k, 2) the values of a condition between which a step from `low` to `high` can lie.

    Between two power-ons: within one, records that differ would choose it, as the drift of a bias makes them.
    Where one power-on is all there is, between any two records.
    """
    values = np.unique(np.round(condition, 3))
    gaps = np.column_stack([values[:-1], values[1:]])
    middles = gaps.mean(axis=1)
    inside = (middles >= low) & (middles <= high)
    _, which = np.unique(run, return_inverse=True)
    first, last = np.full((2, which.max(initial=-1) + 1), [[np.inf], [-np.inf]])
    np.minimum.at(first, which, condition)
    np.maximum.at(last, which, condition)
    begins, ends = (np.searchsorted(middles, x) for x in (first, last))
    spans = np.zeros(len(values), dtype=int)
    np.add.at(spans, begins, 1)
    np.add.at(spans, ends, -1)
    between = inside & (np.cumsum(spans)[: len(gaps)] == 0)
    return np.asarray(gaps[between if between.any() else inside])
