"""Misalignment that changes with temperature, y_i += m_ij (T − 20 °C) u_j, i ≠ j (K 2.2.4 and 2.4).

Package and board bend as they warm up: the angle of table 2.6 of K, measured at another temperature.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import REFERENCE_DEGC
from planner.effects.misalignment import Misalignment
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Sensor


class MisalignmentTemperature(Misalignment):
    """m_ij, by how much the angle of channel i towards axis j changes per kelvin; zero at 20 °C."""

    name = "misalignment_temperature"
    units: Mapping[Sensor, str] = {"gyro": "deg/K", "accelerometer": "deg/K"}
    needs = frozenset[Condition](("rate", "specific_force", "temperature_degc"))
    variable: Condition | None = "temperature_degc"
    temperature_of = "misalignment"
    title = "misalignment over temperature"
    equation = "y_i += m_ij (T − 20 °C) u_j, i ≠ j"
    source = "K 2.2.4 and 2.4"

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(T − 20 °C) u_j on channel i: (n, 3, 6)."""
        warmer = conditions.temperature_degc - REFERENCE_DEGC
        return warmer[:, np.newaxis, np.newaxis] * super().regressors(sensor, conditions, nonlinear)


EFFECT = MisalignmentTemperature()
