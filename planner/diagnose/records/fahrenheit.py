"""Temperatures in degF under a heading that says degC, in all records or from a power-on on, or up to one.

A chamber is set to the same few points again and again. Where all points t of one part of a campaign are,
converted, those of the other part,

    |(t_i − 32)/1.8 − T_j| < 1 K   for every i and some j,

and as read they are not, the file of that part was written in degF: each of m points meets one of k within
100 K by chance with k/50, three of four or five in 1 of 1e3, and never only then when it is converted. So it
was where records are hotter than any chamber of the spec gets, and converted are not. It is asked before any
error model: 25 degC read as 77 is as far off as another unit's curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.records.another_unit import channels_of
from planner.diagnose.records.times_of_records import by_run
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.temperature_table import GAP_K, temperature_nodes

LEAST_POINTS = 3  # of the part that is converted, which meet those of the others
SAME_K = 1.0  # in degC, within which a chamber is at the same point: as read 1.8 of them
APART_K = 3.0  # from which it is not, as read; −40 is −40 in both
HOTTER_K = 10.0  # than a chamber goes, by its own word: no slip of a thermometer
MOST_ROWS = 20_000  # larger tables are recordings, not soaks at points
MOST_POINTS = 40  # more are sweeps, whose points are close enough to meet by chance
SHARE = 0.2  # of a range, that points with their SAME_K may cover


@dataclass(frozen=True)
class Fahrenheit:
    """table: with all temperatures in degC; runs: power-ons that were converted, in their order"""

    table: DwellTable
    runs: NDArray[np.int64]
    every: bool

    @property
    def suspect(self) -> ReferenceSuspect:
        """As it is reported."""
        first, last = int(self.runs[0]), int(self.runs[-1])
        where = "all records" if self.every else f"runs {first} to {last}"
        check = (
            f"look up in which unit the temperatures of {where} were written: they look like degF; "
            "they are judged converted"
        )
        value = float(first)
        return ReferenceSuspect(
            "mixed_units", value, value, value, "run", channels_of(self.table), 0.0, float("inf"),
            check, float("inf"),
        )  # fmt: skip


def in_fahrenheit(table: DwellTable, chambers: Sequence[tuple[float, float]]) -> Fahrenheit | None:
    """The table with the temperatures of some power-ons, or all, converted, where these were in degF.

    chambers: coldest and hottest, degC, of the spec's benches
    """
    t = table.temperature_degc
    if "temp_degc" in table.absent or not np.isfinite(t).all():
        return None
    part = _part(table)
    if part is not None or not chambers:
        return part
    hottest, coldest = max(top for _, top in chambers), min(bottom for bottom, _ in chambers)
    hot = t > hottest + HOTTER_K
    converted = _celsius(t[hot])
    if not hot.any() or converted.max() > hottest + GAP_K or converted.min() < coldest - GAP_K:
        return None
    return _converted(table, _about(table, hot))


def _about(table: DwellTable, hot: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) rows in degF, where some are hotter than a chamber gets: all, or from those on, or up to those.

    A file that is all in degF has the points before the first hot record behind it too, as they are read.
    Where no point comes again nothing speaks for two files.
    """
    t, run = table.temperature_degc, table.run[hot]
    if not _come_again(table):
        return np.ones(len(t), dtype=bool)
    for rows in (table.run >= run.min(), table.run <= run.max()):
        if not rows.all():
            there = temperature_nodes(t[rows])
            apart = np.abs(temperature_nodes(t[~rows])[:, None] - there).min(axis=1)
            if np.any(apart > APART_K):
                return np.asarray(rows)
    return np.ones(len(t), dtype=bool)


def _come_again(table: DwellTable) -> bool:
    t = table.temperature_degc[np.lexsort((table.time_on, table.run))]
    points = temperature_nodes(t)
    visits = 1 + np.count_nonzero(np.diff(np.argmin(np.abs(t[:, None] - points), axis=1)))
    return bool(visits > len(points))


def _part(table: DwellTable) -> Fahrenheit | None:
    """The power-ons before or from one on, whose points are those of the others when converted."""
    t, (runs, starts) = table.temperature_degc, by_run(table)
    if len(table) > MOST_ROWS or len(runs) < 2 or len(temperature_nodes(t)) < LEAST_POINTS:
        return None
    order = np.lexsort((table.time_on, table.run))
    means = np.add.reduceat(t[order], starts) / np.diff(np.append(starts, len(t)))
    halves = (rows for k in _borders(means) for rows in (table.run >= runs[k], table.run < runs[k]))
    found = [rows for rows in halves if _meets(t[rows], t[~rows])]
    if not found:
        return None
    first = order[starts]
    best = min(found, key=lambda rows: (_points(means, rows[first]), -int(rows.sum())))
    return _converted(table, best)


def _points(means: Array, runs: NDArray[np.bool_]) -> int:
    """How many points there are with some power-ons converted: −45 degC taken for degF is one more."""
    right = np.sort(np.where(runs, _celsius(means), means))
    return 1 + int(np.count_nonzero(np.diff(right) > SAME_K))


def _borders(means: Array) -> list[int]:
    """Power-ons from which on it may be another unit: those whose mean no earlier one has, or none later."""
    near = np.abs(means[:, None] - means) < APART_K
    order = np.arange(len(means))
    first = [k for k in range(1, len(means)) if not near[k, :k].any()]
    last = [k for k in range(1, len(means)) if not near[k - 1, order >= k].any()]
    return sorted({*first, *last})


def _meets(read: Array, others: Array) -> bool:
    """Whether all points of some rows are points of the others when converted, and as read hardly one is."""
    here, there = temperature_nodes(read), temperature_nodes(others)
    if len(here) < LEAST_POINTS or max(len(here), len(there)) > MOST_POINTS:
        return False
    if 2.0 * SAME_K * len(there) > SHARE * max(float(np.ptp(there)), 1e-9):
        return False
    as_read = np.abs(here[:, None] - there).min(axis=1)
    converted = np.abs(_celsius(here)[:, None] - there).min(axis=1)
    moves = np.abs(_celsius(here) - here) > APART_K
    told = moves & (as_read > APART_K)
    return bool(np.all(converted < SAME_K) and np.count_nonzero(told) >= max(LEAST_POINTS, len(here) - 1))


def _celsius(t: Array) -> Array:
    return (t - 32.0) / 1.8


def _converted(table: DwellTable, rows: NDArray[np.bool_]) -> Fahrenheit:
    right = replace(
        table,
        temperature_degc=np.where(rows, _celsius(table.temperature_degc), table.temperature_degc),
        temperature_rate=np.where(rows, table.temperature_rate / 1.8, table.temperature_rate),
    )
    return Fahrenheit(right, np.unique(table.run[rows]), bool(rows.all()))
