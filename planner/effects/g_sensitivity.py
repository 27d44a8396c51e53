"""Gyro bias that follows the specific force, y_i += k_ix f_x + k_iy f_y + k_iz f_z (K 2.2.6, eq. 21)."""

from __future__ import annotations

from collections.abc import Mapping

from planner.effects._channels import AXES, BaseEffect, side_by_side
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term


class GSensitivity(BaseEffect):
    """k_ij, the bias of gyro i per specific force along body axis j."""

    name = "g_sensitivity"
    sensors: tuple[Sensor, ...] = ("gyro",)
    units: Mapping[Sensor, str] = {"gyro": "deg/s/g"}
    group: Group = "bias"
    apart = True
    needs = frozenset[Condition](("specific_force",))
    variable: Condition | None = "specific_force"
    linear_in_force = True
    title = "g-sensitivity"
    equation = "y_i += k_ix f_x + k_iy f_y + k_iz f_z"
    source = "K 2.2.6, eq. 21"

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """xx, xy, xz, yx, … zz: channel, then the axis of the specific force."""
        return tuple(Term(channel + axis) for channel in AXES for axis in AXES)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """f_j on channel i: (n, 3, 9)."""
        return side_by_side(conditions.specific_force)


EFFECT = GSensitivity()
