"""Narrow alternatives without a name: a few columns for courses of which wide bins see too little.

A wave over twenty power-ons, a gyro that locks in at small rates, an axis that leans as the case warms:
bins of the variable have as many columns as it has levels, and by the criterion each costs log n. They are
asked beside those bins, and of the likelihood where the noise is judged; its full model goes without them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from planner.diagnose.hypotheses.channels import Channel
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.temperature_table import temperature_nodes
from planner.units import STANDARD_GRAVITY_MPS2

CYCLES = (1.0, 1.5, 2.0, 3.0)  # of a wave over all the days
A_CYCLE = 6  # power-ons for each of them
LEAST_APART = 12  # power-ons, below which a wave of the days is anything
LEAST_DAYS = 1.0
SMALL_RATES = (0.02, 0.1, 0.4)  # of the largest rate: up to where a gyro locks in, or leaves its line
LEAST_RATES = 8  # different ones, fewer of which bins follow as well
A_RATE = float(np.radians(1.0))  # by which rates differ; the Earth turns 240 times slower
A_BEND = 3  # nodes of temperature, fewer of which show none
_LOADED = 1.5 * STANDARD_GRAVITY_MPS2  # below that a load is not told from gravity


def waves(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 2) sine and cosine over the days of the table, slow and quick ones, as power-ons show them."""
    runs, span = len(np.unique(table.run)), float(np.ptp(table.day))
    if runs < LEAST_APART or span < LEAST_DAYS:
        return []
    turns = (table.day - table.day.min()) / span
    around = [2.0 * np.pi * k * turns for k in CYCLES if k * A_CYCLE <= runs]
    return [np.column_stack([np.sin(x), np.cos(x)]) for x in around]


def odd_courses(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 5) of a gyro's own rate x: itself held at small sizes, x |x| and x³."""
    x = _turning(c)
    if c.sensor != "gyro" or len(np.unique(np.round(x / A_RATE))) < LEAST_RATES:
        return []
    x = x / np.abs(x).max()
    return [np.column_stack([*(np.clip(x, -k, k) / k for k in SMALL_RATES), x * np.abs(x), x**3])]


def rate_under_load(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 3) a scale factor that goes with the load, signed: a gyro's own rate times each force.

    Gravity alone is up or down, as the turns are: only an arm tells the one from the other.
    """
    force = c.model.conditions.specific_force
    if c.sensor != "gyro" or not np.any(np.linalg.norm(force, axis=1) > _LOADED):
        return []
    return [_turning(c)[:, None] * force]


def leaning(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 4) the forces across an accelerometer, in any attitude, times the temperature and its square."""
    if c.sensor != "accelerometer" or len(temperature_nodes(table.temperature_degc)) < A_BEND:
        return []
    t = ((table.temperature_degc - 20.0) / 60.0)[:, None]
    across = np.delete(c.model.conditions.specific_force, c.axis, axis=1)
    return [np.concatenate([across * t, across * t**2], axis=1)]


def force_over_days(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 3) a gyro's sensitivity to forces that changes from day to day: each force times the days."""
    span = float(np.ptp(table.day))
    if c.sensor != "gyro" or span < LEAST_DAYS or len(np.unique(table.run)) < LEAST_APART:
        return []
    return [c.model.conditions.specific_force * ((table.day - table.day.mean()) / span)[:, None]]


def _turning(c: Channel) -> Array:
    """(n,) the own rate of a gyro; the Earth's at rest is none."""
    return np.where(np.abs(c.u) > A_RATE, c.u, 0.0)


MAKERS: Mapping[str, Callable[[Channel, DwellTable], list[Array]]] = {
    "day": waves,
    "rate": odd_courses,
    "rate_and_specific_force": rate_under_load,
    "temperature": leaning,
    "day_and_specific_force": force_over_days,
}
"""What they vary with -> what makes them."""
