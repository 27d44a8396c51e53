"""A centrifuge's arm and fixture tilt under load: y += θ × u, θ proportional to the load (K 2.2.6, eq. 4).

No fault of the unit: what it feels is not what the reference says. With the load f_h across the axis of the
turn, r along it, u_p along the axis and t = u_p × r, the tilt by angles per load has three parts

    arm   about t: the end of the arm droops, whichever way the unit is mounted
    face  about t without its sign: the fixture gives way to the same side of the unit
    twist about u_p: the load itself turns towards the tangent
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._bench_frame import load, upwards
from planner.effects._channels import BOTH, BaseEffect, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term

PARTS: Mapping[Sensor, tuple[str, ...]] = {
    "gyro": ("arm", "face"),
    "accelerometer": ("arm", "face", "twist"),
}


class ArmBending(BaseEffect):
    """Angles per load of arm, face and twist, shared by the three channels; K finds 0.1 deg at 50 g."""

    name = "arm_bending"
    sensors: tuple[Sensor, ...] = BOTH
    units: Mapping[Sensor, str] = {"gyro": "deg/g", "accelerometer": "deg/g"}
    group: Group = "misalignment"
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "specific_force"
    title = "bending of the centrifuge's arm"
    equation = "y += θ × u, θ proportional to the load"
    source = "K 2.2.6, eq. 4"
    bench_only = True

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """The axes of the tilt; a twist about the axis of the turn turns nothing that a gyro feels."""
        return tuple(Term(part, channels=(0, 1, 2)) for part in PARTS[sensor])

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(n, 3, parts) what a tilt of 1 rad per m/s² adds to each channel; zero off the centrifuge."""
        u, up, across = sensed(sensor, conditions), upwards(conditions), load(conditions)
        about = np.cross(up, across)  # t times the load
        size = np.linalg.norm(across, axis=1, keepdims=True)
        turns = (about, np.abs(about), up * size)
        return np.stack([np.cross(turn, u) for turn in turns[: len(PARTS[sensor])]], axis=2)


EFFECT = ArmBending()
