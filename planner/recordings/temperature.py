"""Temperature of a recording: its rate over 10 s or more, and where the sensor is dead."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.conditions import POSSIBLE_DEGC
from planner.recordings.windows import Windows

SHORTEST_S = 10.0  # K 2.4: the rate is known over windows of at least 10 s
JUMP_K = 5.0  # between windows of 50 ms; a chamber does 0.1 K/s
FROZEN_S = 1.0
KNOT_S = 1.0  # a tenth of the 10 s: between two slopes that share nine tenths, a line serves
MOST_KNOTS = 1 << 16


def alive(windows: Windows) -> NDArray[np.bool_]:
    """(n,) windows whose temperature can be believed.

    Not those without a number, beyond −120 .. 150 degC, or standing still for over 1 s at a value that was
    reached or left by a jump of over 5 K.
    """
    value = windows.temperature_degc
    good = np.isfinite(value) & (value >= POSSIBLE_DEGC[0]) & (value <= POSSIBLE_DEGC[1])
    edges = np.flatnonzero(np.nan_to_num(value[1:], nan=1e9) != np.nan_to_num(value[:-1], nan=1e9)) + 1
    bounds = np.array([0, *edges.tolist(), len(value)])
    first, last = bounds[:-1], bounds[1:]
    frozen = windows.end[last - 1] - windows.start[first] > FROZEN_S
    for a, b in zip(first[frozen], last[frozen], strict=True):
        into = a > 0 and abs(value[a] - value[a - 1]) > JUMP_K
        out = b < len(value) and abs(value[b] - value[b - 1]) > JUMP_K
        if into or out:
            good[max(0, a - 1) : b + 1] = False  # the windows at its ends hold a part of the jump
    return np.asarray(good)


def slope(windows: Windows, living: NDArray[np.bool_], start: float, end: float) -> float | None:
    """K/s by least squares over start … end, widened to 10 s about its middle; None for under 5 s known."""
    middle, half = (start + end) / 2, max(end - start, SHORTEST_S) / 2
    first = int(np.searchsorted(windows.end, middle - half))
    last = int(np.searchsorted(windows.start, middle + half, side="right"))
    rows = np.flatnonzero(living[first:last]) + first
    if len(rows) < 3:
        return None
    time = (windows.start[rows] + windows.end[rows]) / 2
    if time[-1] - time[0] < SHORTEST_S / 2:
        return None
    return _line(time, windows.temperature_degc[rows])


def _line(time: Array, value: Array) -> float:
    t = time - time.mean()
    return float(t @ (value - value.mean()) / (t @ t))


def rates(windows: Windows) -> tuple[Array, Array]:
    """Times (m,) s and dT/dt (m,) K/s at them, each the slope over the 10 s about it, where it is known.

    At the ends of the recording the 10 s lie within it, so that the slope stays centred on what is there.
    """
    if len(windows) == 0:
        return np.zeros(0), np.zeros(0)
    start, end = float(windows.start[0]), float(windows.end[-1])
    count = int(min(max(end - start, 0.0) / KNOT_S, MOST_KNOTS)) + 2
    at = np.linspace(start, end, count)
    half = min(SHORTEST_S, end - start) / 2.0
    middle = np.clip(at, start + half, end - half)
    living = alive(windows)
    found = [slope(windows, living, m, m) for m in middle]
    known = np.array([rate is not None for rate in found])
    return at[known], np.array([rate for rate in found if rate is not None], dtype=float)
