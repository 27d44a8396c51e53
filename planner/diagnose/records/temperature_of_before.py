"""A thermometer that is read one record late: every record has the temperature of the one before it.

Where a power-on soaks at one temperature after another, the first record of each soak is then written at the
temperature of the soak before, 30 K off, and channel by channel that looks like a lag of the sensors, with a
time constant as long as a record. It is asked before any error model, by the readings about the means of
power-ons under scale factor, leans and tables over temperature, once as it is written and once moved on by a
record:

    Σ n/2 ln(S(T)/S(T')) over the channels

A thermometer that lags by a time constant, T' = T + τ dT/dt, is as far behind on a ramp: where some τ makes
the readings as likely it is no record late, and `lagging_thermometer` tells how much it lags.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import about_means, explained
from planner.diagnose.findings.lagging_thermometer import LAGS_S, ahead
from planner.diagnose.records.another_unit import channels_of
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.solvers.distributions import chi_square_tail
from planner.temperature_table import GAP_K, hats, temperature_nodes

MOST_ROWS = 20_000  # of which it is asked: larger tables are recordings, not dwells
LEAST_STEPS = 4  # records that follow one at another temperature, of which a rate of it says nothing
SURE = 30.0  # of the log of the odds, over all channels
EACH = 5.0  # of a channel that tells it, or denies it
SEVERAL = 3  # channels that tell it; of one or two it is the sensors' own lag


@dataclass(frozen=True)
class TemperatureOfBefore:
    """table: with the temperatures put right; seconds: from record to record; told: channels that say so"""

    table: DwellTable
    seconds: float
    told: tuple[str, ...]
    strength: float

    @property
    def suspect(self) -> ReferenceSuspect:
        """As it is reported."""
        check = (
            "look up when the thermometer is read: each record has the temperature of the one before it; "
            "they are judged with it put right"
        )
        return ReferenceSuspect(
            "thermometer_lag", self.seconds, self.seconds, self.seconds, "s", self.told,
            float(chi_square_tail(self.strength**2, 1)), self.strength, check, float("inf"),
        )  # fmt: skip


def temperature_of_before(
    table: DwellTable, kept: NDArray[np.bool_] | None = None
) -> TemperatureOfBefore | None:
    """The table with each record at the temperature that is written in the next one, if that was its own.

    kept: (n,) rows that may tell it, all unless given
    """
    if len(table) > MOST_ROWS or "temp_degc" in table.absent:
        return None
    order = np.lexsort((table.time_on, table.run))
    after = _after(table.run[order])
    t = table.temperature_degc[order]
    gap = np.where(after, np.append(np.diff(table.time_on[order]), 0.0), 0.0)
    step = np.where(after, np.append(np.diff(t), 0.0), 0.0)
    if np.count_nonzero(np.abs(step - table.temperature_rate[order] * gap) > GAP_K) < LEAST_STEPS:
        return None
    moved = table.temperature_degc.copy()
    moved[order] = t + step
    names = channels_of(table)
    tell = order if kept is None else order[kept[order]]
    odds = dict(zip(names, _odds(table, tell, moved), strict=False))
    told = tuple(c for c, x in odds.items() if x > EACH)
    if len(told) < SEVERAL or min(odds.values()) < -EACH or sum(odds.values()) < SURE:
        return None
    if _lags_as_well(table, tell, odds):
        return None
    right = replace(table, temperature_degc=moved)
    strength = float(np.sqrt(2.0 * sum(odds.values())))
    return TemperatureOfBefore(right, float(np.median(gap[after])), told, strength)


def _lags_as_well(table: DwellTable, order: NDArray[np.int64], odds: Mapping[str, float]) -> bool:
    """Whether some time constant makes the readings as likely as the temperatures of the next records do."""
    later = (ahead(table, lag).temperature_degc for lag in LAGS_S)
    return any(sum(_odds(table, order, t)) > sum(odds.values()) - SURE for t in later)


def _after(run: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) whether a record has one behind it in its power-on."""
    return np.append(np.diff(run) == 0, False)


def _odds(table: DwellTable, order: NDArray[np.int64], moved: Array) -> Iterator[float]:
    """Of every channel with a reference, how much likelier the temperatures of the next records are."""
    _, run = np.unique(table.run[order], return_inverse=True)
    for y, u in ((table.gyro, table.ref_rate), (table.acc, table.ref_acc)):
        if y is None or u is None:
            continue
        for axis in range(3):
            e = (y[:, axis] - u[:, axis])[order]
            told = np.isfinite(e)
            rows = order[told]
            each = (table.temperature_degc[rows], moved[rows])
            _, own = np.unique(run[told], return_inverse=True)  # a power-on may have none of this channel
            left = [_left(e[told], u[rows], t, own, axis) for t in each]
            yield 0.5 * len(rows) * float(np.log(max(left[0], 1e-300) / max(left[1], 1e-300)))


def _left(e: Array, u: Array, t: Array, run: NDArray[np.int64], axis: int) -> float:
    """What is left of the square of e (n,) about the means of power-ons."""
    H = hats(t, temperature_nodes(t), 0.0)
    X = np.column_stack([H, H * u[:, [axis]], np.delete(u, axis, axis=1), e])
    about = about_means(X, run)
    nothing = np.zeros((len(e), 0))
    gain, _ = explained(nothing, about[:, :-1], about[:, -1], 1e-6)
    return float(about[:, -1] @ about[:, -1]) - gain
