"""A table's rate that is off by another share at every rate that is set, either way: a servo, or its cogs.

    δω_l = γ_l ω_l   at each signed rate l but the last,  common to the gyros

The angle of a turn that is read at its ends is off by what the encoder is there, sin φ, and φ is the rate
times the time of a record: a curve over the rate that no power of it follows. One gyro with such a curve is a
gyro; three with the same one are read by the same table.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.references.bench_directions import loaded, through_the_unit
from planner.effects._bench_frame import turning, upwards
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable

LEAST = 4  # signed rates: of fewer a share of each way says all
MOST = 24  # more are no levels
ONE_LEVEL = 0.02  # of a rate, by which records of one level differ


def off_at_each_level(c: Channel, table: DwellTable, place: float) -> Array:
    """(n, levels − 1) a share of the rate at each signed level, beside that at the last one.

    What all levels have in common is the scale factor of each gyro as well.
    """
    conditions = c.model.conditions
    level = _levels(conditions)
    return but_the_last(through_the_unit(c, [conditions.rate])[:, 0], level)


def set_rates(table: DwellTable) -> Sequence[float]:
    """One place, where some rates are set again and again."""
    if table.ref_rate is None:
        return ()
    return one_place(_levels(table.conditions()), LEAST)


def sense(conditions: Conditions) -> Array:
    """(n,) +1, −1: the table's way about up, or the body's where its axis lies; 0 at rest."""
    rate, up = conditions.rate, upwards(conditions)
    size = np.linalg.norm(rate, axis=1)
    about_up = np.sum(rate * up, axis=1)
    own = rate[np.arange(len(rate)), np.argmax(np.abs(rate), axis=1)]
    return np.where(turning(conditions), np.sign(np.where(2.0 * np.abs(about_up) > size, about_up, own)), 0.0)


def _levels(conditions: Conditions) -> Array:
    """(n,) number of each row's signed rate on the table; −1 of all other rows."""
    here = turning(conditions) & ~loaded(conditions)
    rate = np.where(here, sense(conditions) * np.linalg.norm(conditions.rate, axis=1), 0.0)
    return levels_of(rate, here, ONE_LEVEL, 1e-4)


def levels_of(rate: Array, here: NDArray[np.bool_], share: float, least: float = 0.0) -> Array:
    """(n,) number of each row's level; −1 of rows that are not here. One is within a share and `least`."""
    values = np.unique(rate[here])
    if len(values) == 0:
        return np.full(len(rate), -1)
    apart = np.append(True, np.diff(values) > share * np.abs(values[1:]) + least)
    which = (np.cumsum(apart) - 1)[np.clip(np.searchsorted(values, rate), 0, len(values) - 1)]
    return np.where(here, which, -1)


def but_the_last(along: Array, level: Array) -> Array:
    """(n, levels − 1) what is along (n,) at each level but the last."""
    return np.column_stack([along * (level == k) for k in range(int(level.max(initial=-1)))])


def one_place(level: Array, least: int) -> Sequence[float]:
    """One place, where rows have as many levels as are set again and again."""
    return (0.0,) if least <= int(level.max(initial=-1)) + 1 <= MOST else ()
