"""Misalignment: channel i feels a little of axis j, y_i += m_ij u_j, i ≠ j (K 2.2.4; M = I + m).

Six terms a triad: channels are mounted one by one, so m is neither symmetric nor skew. The angle stands for
its sine, 5e-6 of it off at 0.3 deg.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import AXES, BOTH, BaseEffect, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term

PAIRS = tuple((i, j) for i in range(3) for j in range(3) if i != j)


class Misalignment(BaseEffect):
    """m_ij, the angle by which channel i leans towards body axis j."""

    name = "misalignment"
    sensors: tuple[Sensor, ...] = BOTH
    units: Mapping[Sensor, str] = {"gyro": "deg", "accelerometer": "deg"}
    group: Group = "misalignment"
    apart = True
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "rate"
    linear_in_force = True
    title = "misalignment"
    equation = "y_i += m_ij u_j, i ≠ j"
    source = "K 2.2.4"

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """xy, xz, yx, yz, zx, zy: channel, then the axis that it leans towards."""
        return tuple(Term(AXES[i] + AXES[j]) for i, j in PAIRS)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """u_j on channel i: (n, 3, 6)."""
        u = sensed(sensor, conditions)
        regressors = np.zeros((len(u), 3, len(PAIRS)))
        for term, (i, j) in enumerate(PAIRS):
            regressors[:, i, term] = u[:, j]
        return regressors


EFFECT = Misalignment()
