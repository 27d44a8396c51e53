"""What a unit is exposed to at every instant of a power-on: in records as planned, between them on its way.

Angles of the axes go from one record to the next by cubics that meet position and rate at both ends; a load
of a centrifuge goes straight from one to the next. The mean over a record is that of `campaign.exposure`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.campaign.design import Design
from planner.campaign.exposure import AXIS_2, UP, Asked, in_body, mounted
from planner.nouns.array import Array
from planner.physics.earth import EARTH_RATE_RADPS
from planner.units import STANDARD_GRAVITY_MPS2


@dataclass(frozen=True)
class Records:
    """The records of one power-on: rows (m,) of the design; begin, end: (m,) s since power-on."""

    rows: NDArray[np.int64]
    begin: Array
    end: Array

    def at(self, time: Array) -> NDArray[np.int64]:
        """(n,) number of the record that an instant is in, or that comes next; the last one after it."""
        return np.minimum(np.searchsorted(self.end, time), len(self.rows) - 1)

    def inside(self, time: Array) -> NDArray[np.bool_]:
        """(n,) whether an instant is in a record."""
        k = self.at(time)
        return np.asarray((time >= self.begin[k]) & (time < self.end[k]))


def records_of(design: Design, rows: NDArray[np.int64]) -> Records:
    """The records of a run; rows: (m,) of the design."""
    middle, half = design.conditions.time_on[rows], design.duration[rows] / 2.0
    return Records(rows, middle - half, middle + half)


def exposed(design: Design, records: Records, time: Array) -> tuple[Array, Array]:
    """(n, 3) inertial rate, rad/s, and (n, 3) specific force, m/s², in the body on a perfect bench."""
    asked = [design.asked[i] for i in records.rows]
    if any("acceleration_g" in one.motion for one in asked):
        return _loaded(design, records, time)
    number, mount = records.at(time), np.array([one.mount for one in asked])
    (p1, w1), (p2, w2) = (_angles(asked, records, time, axis) for axis in (1, 2))
    earth = EARTH_RATE_RADPS * np.array([np.cos(asked[0].latitude), 0.0, np.sin(asked[0].latitude)])
    rate = in_body(earth, p1, p2) + w1[:, None] * UP + w2[:, None] * in_body(AXIS_2, p1, 0.0 * p2)
    force = STANDARD_GRAVITY_MPS2 * in_body(UP, p1, p2)
    for m in np.unique(mount):
        of = mount[number] == m
        rate[of], force[of] = rate[of] @ mounted(int(m)).T, force[of] @ mounted(int(m)).T
    return rate, force


def warmed(design: Design, records: Records, time: Array, degc: Array) -> tuple[Array, Array]:
    """(n,) temperature, degC, and its rate, K/s; degc: (m,) true mean of each record.

    Straight from one soaked record to the next. On ramps each record is in the middle of its way, so half-way
    to the next one the chamber turns; before the first and after the last it stands where it turns.
    """
    middle = (records.begin + records.end) / 2.0
    rates = design.conditions.temperature_rate[records.rows]
    if not rates.any():
        return np.interp(time, middle, degc), np.zeros(len(time))
    turns = (middle[1:] + middle[:-1]) / 2.0
    k = np.searchsorted(turns, time)
    half = np.max(np.diff(middle), initial=2.0 * float(np.max(records.end - middle))) / 2.0
    since = np.clip(time - middle[k], -half, half)
    moves = np.abs(time - middle[k]) <= half
    return degc[k] + rates[k] * since, np.where(moves, rates[k], 0.0)


def _loaded(design: Design, records: Records, time: Array) -> tuple[Array, Array]:
    """On a centrifuge: the record's own rate and load, and straight lines between them."""
    moments = np.stack([records.begin, records.end], axis=1).ravel()
    found = []
    for values in (design.conditions.rate, design.conditions.specific_force):
        corners = np.repeat(values[records.rows], 2, axis=0)
        found.append(np.stack([np.interp(time, moments, corners[:, i]) for i in range(3)], axis=1))
    return found[0], found[1]


def _angles(asked: Sequence[Asked], records: Records, time: Array, axis: int) -> tuple[Array, Array]:
    """(n,) angle of an axis, rad, and (n,) its rate, rad/s.

    A record has its own rate from its first instant on: where the plan leaves no time before it (at power-on,
    or behind another record) there is a step, and no part of the record is on its way.
    """
    from scipy.interpolate import CubicHermiteSpline

    start = np.radians([one.motion.get(f"position_{axis}_deg", 0.0) for one in asked])
    speed = np.radians([one.motion.get(f"rate_{axis}_dps", 0.0) for one in asked])
    moments, angles, rates, now = [0.0], [start[0]], [0.0], float(start[0])
    begins = np.empty(len(asked))
    for k, (a, b) in enumerate(zip(records.begin, records.end, strict=True)):
        begin = start[k] + 2.0 * np.pi * np.round((now - start[k]) / (2.0 * np.pi))  # the shorter way
        begins[k], now = begin, begin + speed[k] * (b - a)
        if a > moments[-1]:
            moments, angles, rates = [*moments, a], [*angles, begin], [*rates, speed[k]]
        moments, angles, rates = [*moments, b], [*angles, now], [*rates, speed[k]]
    path = CubicHermiteSpline(moments, angles, rates)
    until = np.minimum(time, moments[-1])
    inside, of = records.inside(time), records.at(time)
    straight = begins[of] + speed[of] * (time - records.begin[of])
    return np.where(inside, straight, path(until)), np.where(inside, speed[of], path(until, 1))
