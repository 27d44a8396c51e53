"""Products of inputs, rates or forces: y_i += Σ_jk c_ijk u_j u_k (IEEE Std 1293)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import AXES, BOTH, BaseEffect, sensed, side_by_side
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term

PAIRS = tuple((j, k) for j in range(3) for k in range(j, 3))


class CrossCoupling(BaseEffect):
    """c_ijk, the bias of channel i per product of the inputs along body axes j and k; squares included."""

    name = "cross_coupling"
    sensors: tuple[Sensor, ...] = BOTH
    units: Mapping[Sensor, str] = {"gyro": "s/deg", "accelerometer": "mg/g**2"}
    group: Group = "bias"
    apart = True
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "rate"  # its input: an accelerometer's is the load
    title = "cross-coupling"
    equation = "y_i += Σ c_ijk u_j u_k"
    source = "IEEE Std 1293, cross-coupling coefficients"

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """xxx, xxy, xxz, xyy, xyz, xzz, yxx, …: channel, then the axes of the two inputs."""
        return tuple(Term(channel + AXES[j] + AXES[k]) for channel in AXES for j, k in PAIRS)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """u_j u_k on channel i: (n, 3, 18)."""
        u = sensed(sensor, conditions)
        return side_by_side(np.stack([u[:, j] * u[:, k] for j, k in PAIRS], axis=1))


EFFECT = CrossCoupling()
