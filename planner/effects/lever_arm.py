"""Lever arm: an accelerometer off the point for which the specific force is known (size effect, K 2.2.6).

    y += ω × (ω × r) = ω (ω·r) − |ω|² r

r is shared by the three channels. The angular acceleration's part, ω̇ × r, averages out of a record of a
steady turn.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import AXES, BaseEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term


class LeverArm(BaseEffect):
    """r, body axes: from the reference's point to the accelerometers."""

    name = "lever_arm"
    sensors: tuple[Sensor, ...] = ("accelerometer",)
    units: Mapping[Sensor, str] = {"accelerometer": "m"}
    largest: Mapping[Sensor, float] | None = {"accelerometer": 10.0}  # the longest arms of centrifuges
    group: Group = "bias"
    needs = frozenset[Condition](("rate",))
    variable: Condition | None = "rate"
    title = "lever arm of the accelerometers"
    equation = "y += ω (ω·r) − |ω|² r"
    source = "K 2.2.6"
    bench_only = True

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """x, y, z of r."""
        return tuple(Term(axis, channels=(0, 1, 2)) for axis in AXES)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """ω_i ω_j − δ_ij |ω|²: (n, 3, 3)."""
        w = conditions.rate
        square = np.sum(w * w, axis=1)[:, np.newaxis, np.newaxis]
        return np.asarray(w[:, :, np.newaxis] * w[:, np.newaxis, :] - square * np.eye(3))


EFFECT = LeverArm()
