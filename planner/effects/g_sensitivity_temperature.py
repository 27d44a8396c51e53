"""g-sensitivity that changes with temperature, y_i += (T − 20 °C) (k_ix f_x + k_iy f_y + k_iz f_z)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import REFERENCE_DEGC, side_by_side
from planner.effects.g_sensitivity import GSensitivity
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Sensor


class GSensitivityTemperature(GSensitivity):
    """k_ij, the change of gyro i's g-sensitivity along body axis j per kelvin."""

    name = "g_sensitivity_temperature"
    units: Mapping[Sensor, str] = {"gyro": "deg/s/g/K"}
    needs = frozenset[Condition](("specific_force", "temperature_degc"))
    title = "g-sensitivity over temperature"
    equation = "y_i += (T − 20 °C) Σ k_ij f_j"
    source = "K 2.2.6, eq. 21, over temperature"

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(T − 20 °C) f_j on channel i: (n, 3, 9)."""
        warmer = conditions.temperature_degc[:, np.newaxis] - REFERENCE_DEGC
        return side_by_side(conditions.specific_force * warmer)


EFFECT = GSensitivityTemperature()
