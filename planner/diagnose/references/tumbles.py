"""The Earth's rate, left out of the reference of a tumble: what it adds to every gyro between the faces too.

    y += Ω sin φ · up + Ω cos φ (cos α · a × up + sin α · a),   a the head's level axis in body axes

The library's `earth_rate` knows north of a face that is level, by the fixture's convention; a unit that is
turned about a level axis in steps has it across that axis in every one of them. Nine g-coefficients, three a
gyro, follow the vertical part of it and the mean of the other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.references.bench_directions import HORIZONTAL, loaded, through_the_unit
from planner.effects._bench_frame import turning, upwards
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable

TERMS = ("up", "north", "east", "", "", "", "")  # behind them, of faces that stand in no tumble
BETWEEN_FACES = 0.98  # cosine of up with an axis, below which no face is level (planner.effects.earth_rate)
ONE_PLANE = 0.02  # rms of up's part along the axis, 1 deg: how well a unit is mounted on a head
AROUND = 0.2  # of the rows, by which up spreads in both directions of the plane


def forgotten_rate(c: Channel, table: DwellTable, place: float) -> Array:
    """(n, 7) up; in tumbles across the axis and along it; elsewhere north and east as in `earth_rate`."""
    conditions = c.model.conditions
    up, axis = upwards(conditions), tumbling_axis(conditions, table.run)
    apart = ~turning(conditions) & ~np.any(axis, axis=1)
    level = (np.abs(up) > BETWEEN_FACES) & apart[:, np.newaxis]
    north = np.roll(level.astype(float), 1, axis=1)
    over = np.sign(np.sum(up * level, axis=1, keepdims=True))
    east = np.cross(north, up)
    added = (up, np.cross(axis, up), axis, north, east, over * north, over * east)
    return through_the_unit(c, added)


def without_north(table: DwellTable) -> tuple[float, ...]:
    """One place, where some power-on is a tumble and no rest has a horizontal rate in its reference."""
    conditions = table.conditions()
    still = _still(conditions)
    up = upwards(conditions)
    across = conditions.rate - up * np.sum(up * conditions.rate, axis=1, keepdims=True)
    told = np.linalg.norm(across, axis=1)[still] > HORIZONTAL
    return () if told.any() or not tumbling_axis(conditions, table.run).any() else (0.0,)


def tumbling_axis(conditions: Conditions, run: NDArray[np.int64]) -> Array:
    """(n, 3) unit vector, its largest part positive, about which a power-on's rests follow each other; or 0.

    run: (n,) number of each row's power-on. Up goes around in one plane, and not from face to face alone.
    """
    up, still = upwards(conditions), _still(conditions)
    axis = np.zeros_like(up)
    for one in np.unique(run[still]):
        rows = np.flatnonzero(still & (run == one))
        if not (np.abs(up[rows]).max(axis=1) < BETWEEN_FACES).any():
            continue
        _, spread, ways = np.linalg.svd(up[rows], full_matrices=False)
        spread = np.append(spread, np.zeros(3 - len(spread))) / np.sqrt(len(rows))
        if spread[2] < ONE_PLANE and spread[1] > AROUND and len(ways) == 3:
            a = ways[2]
            axis[rows] = a * np.sign(a[np.argmax(np.abs(a))])
    return axis


def _still(conditions: Conditions) -> NDArray[np.bool_]:
    """(n,) whether a row is a rest under gravity alone."""
    return np.asarray(~turning(conditions) & ~loaded(conditions))
