"""A strapdown navigation system's own outputs on a bench: attitude and velocity, record by record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array


@dataclass(frozen=True)
class NavigationRecord:
    """m samples of one record, from a start at which the system was told the bench's attitude and velocity.

    time_s: (m,) since power-on; attitude: (m, 3) roll, pitch, heading, rad; velocity: (m, 3) north, east,
    down, m/s; temperature_degc: (m,); lines: (m,) of the file, from 1
    latitude: rad; altitude: m, of the bench
    table_rate: (3,) rate of the body over the ground that the bench sets, in body axes, rad/s; 0 at rest
    table_force: (3,) specific force that the bench sets, in body axes, m/s²; None where gravity is all
    """

    unit: str
    run: int
    day: float
    name: str
    time_s: Array
    attitude: Array
    velocity: Array
    temperature_degc: Array
    latitude: float
    altitude: float
    table_rate: Array
    table_force: Array | None
    lines: NDArray[np.int64]


@dataclass(frozen=True)
class NavigationLog:
    """All records of a file; notes: what was found odd, or taken for granted, each a sentence."""

    records: tuple[NavigationRecord, ...]
    source: str
    notes: tuple[str, ...] = ()
