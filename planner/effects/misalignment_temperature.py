"""Misalignment that changes with temperature, y_i += m_ij (T − 20 °C) u_j, i ≠ j (K 2.2.4 and 2.4).

Package and board bend as they warm up: the angle of table 2.6 of K, measured at another temperature.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import AXES, BOTH, REFERENCE_DEGC, Group, sensed
from planner.effects.misalignment import PAIRS
from planner.protocols import Sensor, Term
from planner.records import Array, Conditions


class MisalignmentTemperature:
    """m_ij, by how much the angle of channel i towards axis j changes per kelvin; zero at 20 °C."""

    name = "misalignment_temperature"
    sensors: tuple[Sensor, ...] = BOTH
    units: Mapping[Sensor, str] = {"gyro": "deg/K", "accelerometer": "deg/K"}
    group: Group = "misalignment"
    nonlinear: Mapping[str, float] = {}

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """xy, xz, yx, yz, zx, zy: channel, then the axis that it leans towards."""
        return tuple(Term(AXES[i] + AXES[j]) for i, j in PAIRS)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(T − 20 °C) u_j on channel i: (n, 3, 6)."""
        u = (conditions.temperature_degc - REFERENCE_DEGC)[:, np.newaxis] * sensed(sensor, conditions)
        regressors = np.zeros((len(u), 3, len(PAIRS)))
        for term, (i, j) in enumerate(PAIRS):
            regressors[:, i, term] = u[:, j]
        return regressors


EFFECT = MisalignmentTemperature()
