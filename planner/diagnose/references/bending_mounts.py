"""A fixture that turns the unit more, the warmer it is or the larger the load: all channels of it alike.

    u ↦ u + x θ × u,   x = (T − 20 °C) / 50 K,   or |load| / 10 g on a centrifuge's arm

A plate that bends as the chamber warms it; mounts that give way. Package and board have six angles of each
sensor over temperature, and agree on no turn; the arm's own bending goes with the side of the load.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.diagnose.channels.channel import Channel
from planner.diagnose.references.bench_directions import loaded, through_the_unit
from planner.effects._bench_frame import load
from planner.effects._channels import REFERENCE_DEGC
from planner.measurement import sensed
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.units import STANDARD_GRAVITY_MPS2

SPAN_K, LOAD_G = 50.0, 10.0  # over which, and under which, a turn is told
LEAST_SPAN_K = 20.0  # of all records, below which a fixture bends by little


def bends_with_temperature(c: Channel, table: DwellTable, place: float) -> Array:
    """(n, 3) what angles about x, y and z over 50 K add."""
    return _turned(c, (c.model.conditions.temperature_degc - REFERENCE_DEGC) / SPAN_K)


def at_several_temperatures(table: DwellTable) -> Sequence[float]:
    """One place, where records are at several temperatures."""
    return (0.0,) if np.ptp(table.temperature_degc) > LEAST_SPAN_K else ()


def gives_way_to_load(c: Channel, table: DwellTable, place: float) -> Array:
    """(n, 3) what angles about x, y and z under 10 g add on the arm."""
    conditions = c.model.conditions
    size = np.linalg.norm(load(conditions), axis=1) / (LOAD_G * STANDARD_GRAVITY_MPS2)
    return _turned(c, np.where(loaded(conditions), size, 0.0))


def _turned(c: Channel, share: Array) -> Array:
    u = sensed(c.sensor, c.model.conditions) * share[:, None]
    return through_the_unit(c, [np.cross(np.broadcast_to(e, u.shape), u) for e in np.eye(3)])
