"""Gyro bias that follows products of forces, y_i += Σ_jk k_ijk f_j f_k (IEEE Std 528: g²-sensitivity)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import AXES, BaseEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term

PAIRS = tuple((i, j, k) for i in range(3) for j in range(3) for k in range(j, 3) if not i == j == k)


class GProductSensitivity(BaseEffect):
    """k_ijk, for all pairs of body axes but the sensing axis with itself, which is g_squared_sensitivity."""

    name = "g_product_sensitivity"
    sensors: tuple[Sensor, ...] = ("gyro",)
    units: Mapping[Sensor, str] = {"gyro": "deg/s/g**2"}
    group: Group = "bias"
    apart = True
    needs = frozenset[Condition](("specific_force",))
    variable: Condition | None = "specific_force"
    title = "sensitivity to products of forces"
    equation = "y_i += Σ k_ijk f_j f_k"
    source = "IEEE Std 528"

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """xxy, xxz, xyy, xyz, xzz, yxx, …: channel, then the two axes of the specific force."""
        return tuple(Term(AXES[i] + AXES[j] + AXES[k]) for i, j, k in PAIRS)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """f_j f_k on channel i: (n, 3, 15)."""
        f = conditions.specific_force
        regressors = np.zeros((len(f), 3, len(PAIRS)))
        for term, (i, j, k) in enumerate(PAIRS):
            regressors[:, i, term] = f[:, j] * f[:, k]
        return regressors


EFFECT = GProductSensitivity()
