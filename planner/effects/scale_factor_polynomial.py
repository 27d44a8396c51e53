"""Scale factor over the input as a polynomial, + and − apart (K 2.2.5: its eight rates may have one).

    y_i += κ_i(u_i) u_i,   κ_i(u) = c_i±1 x + c_i±2 x²,   x = |u| / U − 1/500, held in 0 … 1

U is the last of K's inputs, 500 deg/s or 100 g. Below 1/500 of it K finds no scale factor to be told, and
what an axis feels across a turn is none. Beyond U nobody measured: κ keeps the value that it has there, as
a table does, so that a reading beyond the range is corrected by a straight line and not by a parabola that
runs away.

Four coefficients a channel where `scale_factor_curve` has fourteen. With both c_±1 zero and both c_±2 alike
it is `scale_factor_nonlinearity` within the range: declare one of the two.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import AXES, BaseEffect, sensed, side_by_side
from planner.effects._segments import segments_reached
from planner.effects.scale_factor_curve import CURVED, INPUTS, UNIT
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term

POWERS = (1, 2)
SIGNS = (1.0, -1.0)
LEAST = 1.0 / 500.0  # of U
FULL: Mapping[Sensor, float] = {s: INPUTS[s][-1] * UNIT[s][1] for s in INPUTS}  # U in rad/s, m/s²


class ScaleFactorPolynomial(BaseEffect):
    """c_i±k, the part of the relative scale-factor error at U that grows with the k-th power, one way."""

    name = "scale_factor_polynomial"
    units: Mapping[Sensor, str] = {"gyro": "1", "accelerometer": "1"}
    group: Group = "scale_factor"
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "rate"
    title = "scale factor over the input, as a polynomial"
    equation = "y_i += u_i Σ_± Σ_k c_i±k clip(|u_i| / U − 1/500, 0, 1)^k, k = 1, 2, on the side of u_i's sign"
    source = "K 2.2.5, table 2.4"

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """`x +1`, `x +2`, `x -1`, … `z -2`: channel, direction and power."""
        return tuple(
            Term(f"{channel} {sign * power:+g}") for channel in AXES for sign in SIGNS for power in POWERS
        )

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """u_i x^k on the side of u_i's sign: (n, 3, 12)."""
        u = sensed(sensor, conditions)
        size = np.clip(np.abs(u) / FULL[sensor] - LEAST, 0.0, 1.0)
        sides = [np.where(s * u > 0.0, u * size**k, 0.0) for s in SIGNS for k in POWERS]
        return side_by_side(np.stack(sides, axis=2))

    def shows(self, sensor: Sensor, conditions: Conditions) -> bool:
        """Whether the records tell two powers from a cubic: inputs in several segments of K's table."""
        u = np.abs(sensed(sensor, conditions)).max(axis=1, initial=0.0) / UNIT[sensor][1]
        return segments_reached(u, INPUTS[sensor]) >= CURVED


EFFECT = ScaleFactorPolynomial()
