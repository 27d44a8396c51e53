"""What a sensor is exposed to: the one question put to every effect."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

POSSIBLE_DEGC = (-120.0, 150.0)  # a temperature sensor that reads anything else is dead


@dataclass(frozen=True)
class Conditions:
    """What a sensor is exposed to, at n instants or in n records: the one question put to every effect.

    rate: (n, 3) true inertial angular rate in body axes, rad/s
    specific_force: (n, 3) true specific force in body axes, m/s^2
    temperature_degc: (n,); temperature_rate: (n,) K/s
    time_on: (n,) seconds since power-on; day: (n,) days since the calibration
    """

    rate: Array
    specific_force: Array
    temperature_degc: Array
    temperature_rate: Array
    time_on: Array
    day: Array

    def at(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Conditions:
        """Some of the rows, in their order."""
        return Conditions(*(getattr(self, f.name)[rows] for f in fields(self)))
