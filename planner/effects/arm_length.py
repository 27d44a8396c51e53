"""A centrifuge's arm is longer than its drawing says: the load is (1 + k) R ω², K's K_R = 1 + k (K 3.1).

No fault of the unit. K finds K_R as the ratio of 1 g by gravity to 1 g by rotation: gravity gives the scale
factor of the accelerometers, the centrifuge's loads what is left, along with the bending of the arm
(`arm_bending`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._bench_frame import load
from planner.effects._channels import BaseEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term


class ArmLength(BaseEffect):
    """k, shared by the three channels: K_R − 1."""

    name = "arm_length"
    sensors: tuple[Sensor, ...] = ("accelerometer",)
    units: Mapping[Sensor, str] = {"accelerometer": "1"}
    group: Group = "misalignment"
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "specific_force"
    title = "length of the centrifuge's arm"
    equation = "y += k × the load across the axis of the turn"
    source = "K 3.1: K_R = a by gravity / a by rotation"
    bench_only = True
    one_scale = True

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """One for all channels."""
        return (Term("arm", channels=(0, 1, 2)),)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(n, 3, 1) the load in m/s²; zero off the centrifuge."""
        return np.asarray(load(conditions)[:, :, np.newaxis])


EFFECT = ArmLength()
