"""g-sensitivity that changes with temperature, y_i += (T − 20 °C) (k_ix f_x + k_iy f_y + k_iz f_z)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import AXES, REFERENCE_DEGC, BaseEffect, side_by_side
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term


class GSensitivityTemperature(BaseEffect):
    """k_ij, the change of gyro i's g-sensitivity along body axis j per kelvin."""

    name = "g_sensitivity_temperature"
    sensors: tuple[Sensor, ...] = ("gyro",)
    units: Mapping[Sensor, str] = {"gyro": "deg/s/g/K"}
    group: Group = "bias"
    needs = frozenset[Condition](("specific_force", "temperature_degc"))
    variable: Condition | None = "specific_force"
    title = "g-sensitivity over temperature"
    equation = "y_i += (T − 20 °C) Σ k_ij f_j"
    source = "K 2.2.6, eq. 21, over temperature"

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """xx, xy, xz, yx, … zz: channel, then the axis of the specific force."""
        return tuple(Term(channel + axis) for channel in AXES for axis in AXES)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(T − 20 °C) f_j on channel i: (n, 3, 9)."""
        warmer = conditions.temperature_degc[:, np.newaxis] - REFERENCE_DEGC
        return side_by_side(conditions.specific_force * warmer)


EFFECT = GSensitivityTemperature()
