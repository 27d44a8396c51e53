"""What the rows before a row say of it: records of one power-on that follow each other in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.effects._course import along_rates
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, asked_once

RAMP = 0.5 / 60.0  # K/s: a chamber that ramps; a soaked one moves less, and so does a unit that warms itself
ROOM_DEGC = 20.0  # from which the first temperature of a campaign was reached
GRAIN_K = 0.1  # within which a temperature is the same: a thermometer says no less
TURN_K = 3.0  # chamber points lie further apart, and a soaked chamber strays by 2 K at most (K 2.6)


def lag(conditions: Conditions, time_constant: float) -> Array:
    """(n,) K that a body of first order is behind the temperature, T − T_b with dT_b/dt = (T − T_b) / τ.

        L' = s τ + (L − s τ) exp(−h / τ),   s the slope of the temperature over the h seconds between two rows

    The first row of a power-on: L = τ dT/dt (1 − exp(−t / τ)), an even ramp since then. Readings with noise
    are drawn to what their rates say (`along_rates`).
    """
    first = power_ons(conditions)
    t, T = conditions.time_on, _course(conditions)
    step = np.diff(t, prepend=np.inf)
    step = np.where(first, 1.0, np.maximum(step, 1e-9))
    carried = np.where(first, 0.0, np.exp(-step / time_constant))
    slope = np.where(first, 0.0, np.diff(T, prepend=T[:1]) / step)
    start = time_constant * conditions.temperature_rate * -np.expm1(-np.maximum(t, 0.0) / time_constant)
    added = np.where(first, start, slope * time_constant * (1.0 - carried))
    return _recurrence(carried, added)


@asked_once
def _course(conditions: Conditions) -> Array:
    """(n,) °C that every lag follows, whatever its time constant."""
    return along_rates(conditions, power_ons(conditions)).temperature_degc.copy()


def direction(conditions: Conditions) -> Array:
    """(n,) +1 or −1: the way in which the temperature ramps, or last came TURN_K away from where it turned.

    0 before it did. A unit that warms itself by less goes on as it came, as in a play that wide. Rows stand
    in the order of time; the first temperature was reached from that of the room.
    """
    T, rate = conditions.temperature_degc, conditions.temperature_rate
    ramps = np.where(np.abs(rate) > RAMP, np.sign(rate), 0.0)
    asked = (np.diff(np.rint(T / GRAIN_K), prepend=np.inf) != 0.0) | (ramps != 0.0)
    last, turned, ways = 0.0, ROOM_DEGC, ramps[asked].tolist()
    for k, (t, ramp) in enumerate(zip(T[asked].tolist(), ways, strict=True)):
        if ramp or not -TURN_K <= t - turned <= TURN_K:
            last, turned = ramp or (1.0 if t > turned else -1.0), t
        elif last * (t - turned) > 0.0:
            turned = t
        ways[k] = last
    return np.asarray(np.append(0.0, ways)[np.cumsum(asked)])


def changes(conditions: Conditions) -> bool:
    """Whether the temperature changes while the unit is on, by more than a soaked chamber strays.

    Of strays of 0.1 K a lag of minutes made 7 sigma: 0.2 deg/s/K in a campaign without a ramp.
    """
    if np.any(np.abs(conditions.temperature_rate) > RAMP):
        return True
    starts, T = np.flatnonzero(power_ons(conditions)), conditions.temperature_degc
    spans = np.maximum.reduceat(T, starts) - np.minimum.reduceat(T, starts) if len(T) else np.zeros(1)
    return bool(spans.max() > TURN_K)


def power_ons(conditions: Conditions) -> NDArray[np.bool_]:
    """(n,) rows that begin a power-on: time since power-on does not go on from the row before."""
    t = conditions.time_on
    return np.append(True, np.diff(t) <= 0.0)[: len(t)]


def _recurrence(carried: Array, added: Array) -> Array:
    """(n,) x_i = a_i x_{i−1} + b_i by doubling: log n passes over the rows."""
    a, x = carried.copy(), added.copy()
    reach = 1
    while reach < len(x) and a[reach:].any():
        x[reach:], a[reach:] = x[reach:] + a[reach:] * x[:-reach], a[reach:] * a[:-reach]
        reach *= 2
    return x
