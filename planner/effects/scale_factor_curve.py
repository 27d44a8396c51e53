"""Scale factor over the input as a table, + and − apart (K 2.2.5, table 2.4: eight rates, eight loads).

    y_i += κ_i(u_i) u_i,   κ_i(u) = Σ_k c_i±k (1 − share_k(|u|))

K's κ_k = (K_end − K_k)/K_end is counted from the end of the range, where the scale factor is calibrated; the
two ends may differ by `scale_factor_asymmetry`. A coefficient is the change of κ over one segment between
two of K's inputs, so κ at an input is the sum of the segments beyond it. Below the first one κ stays: the
scale factor cannot be told there (K table 2.17).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import AXES, BaseEffect, sensed, side_by_side
from planner.effects._segments import segments_reached, shares
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term
from planner.units import STANDARD_GRAVITY_MPS2

INPUTS: Mapping[Sensor, tuple[float, ...]] = {  # deg/s and g, K table 2.4
    "gyro": (10.0, 25.0, 50.0, 100.0, 200.0, 300.0, 400.0, 500.0),
    "accelerometer": (1.0, 2.0, 5.0, 10.0, 25.0, 50.0, 75.0, 100.0),
}
UNIT: Mapping[Sensor, tuple[str, float]] = {
    "gyro": ("deg/s", float(np.radians(1.0))),
    "accelerometer": ("g", STANDARD_GRAVITY_MPS2),
}
SIGNS = (1.0, -1.0)
CURVED = 5  # segments that the inputs must reach before a table is more than a cubic


class ScaleFactorCurve(BaseEffect):
    """c_i±k, the change of the relative scale-factor error over segment k of the input, one way."""

    name = "scale_factor_curve"
    units: Mapping[Sensor, str] = {"gyro": "1", "accelerometer": "1"}
    group: Group = "scale_factor"
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "rate"
    title = "scale factor over the input, as a table"
    equation = "y_i += u_i Σ_± Σ_k c_i±k (1 − share_k(±u_i)), segments between K's eight inputs"
    source = "K 2.2.5, table 2.4"
    # where the range ends that the table is counted from: records that stop short of it tell no scale factor
    end: Mapping[Sensor, str] = {s: f"{INPUTS[s][-1]:g} {UNIT[s][0]}" for s in INPUTS}

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """`x +10 deg/s`, … `z -400 deg/s`: channel, direction and start of the segment."""
        unit = UNIT[sensor][0]
        return tuple(
            Term(f"{channel} {sign * start:+g} {unit}")
            for channel in AXES
            for sign in SIGNS
            for start in INPUTS[sensor][:-1]
        )

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """u_i (1 − share_k) on the side of u_i's sign: (n, 3, 42)."""
        u = sensed(sensor, conditions)
        below = 1.0 - shares(np.abs(u) / UNIT[sensor][1], INPUTS[sensor])  # (n, 3, 7)
        sides = [np.where(sign * u[..., np.newaxis] > 0.0, below, 0.0) for sign in SIGNS]
        return side_by_side(u[..., np.newaxis] * np.concatenate(sides, axis=2))

    def shows(self, sensor: Sensor, conditions: Conditions) -> bool:
        """Whether the records tell a table from a cubic: inputs in several of its segments."""
        u = np.abs(sensed(sensor, conditions)).max(axis=1, initial=0.0) / UNIT[sensor][1]
        return segments_reached(u, INPUTS[sensor]) >= CURVED


EFFECT = ScaleFactorCurve()
