"""Drift after power-on that changes with temperature: y_i += (T − 20 °C) Σ_k c_ik share_k(t) (K figure 4.7).

K's firmware holds the drift over temperature and time, `drGX[8][20]`; this is the part linear in temperature,
with the times of `drift_curve`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import AXES, REFERENCE_DEGC, BaseEffect, side_by_side
from planner.effects._segments import segments_reached, shares
from planner.effects.drift_curve import CURVED, TIMES_S
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term


class DriftCurveTemperature(BaseEffect):
    """c_ik, the change per kelvin of the rise of channel i's drift over segment k."""

    name = "drift_curve_temperature"
    units: Mapping[Sensor, str] = {"gyro": "deg/s/K", "accelerometer": "mg/K"}
    group: Group = "bias"
    needs = frozenset[Condition](("time_on", "temperature_degc"))
    variable: Condition | None = "time_on"
    title = "drift after power-on over temperature, as a table"
    equation = "y_i += (T − 20 °C) Σ_k c_ik share_k(t)"
    source = "K 2.1, figure 4.7"
    over_time = True  # many values over the time on: what one power-on does is no table

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """`x 10 s`, `x 30 s`, … `z 3600 s`: channel and the segment's end."""
        return tuple(Term(f"{axis} {time:g} s") for axis in AXES for time in TIMES_S[1:])

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(T − 20 °C) share_k(t) on channel i: (n, 3, 27)."""
        warmer = conditions.temperature_degc[:, np.newaxis] - REFERENCE_DEGC
        return side_by_side(warmer * shares(conditions.time_on, TIMES_S))

    def shows(self, sensor: Sensor, conditions: Conditions) -> bool:
        """Whether the records tell a table from simpler curves: times in several of its segments."""
        return segments_reached(conditions.time_on, TIMES_S) >= CURVED


EFFECT = DriftCurveTemperature()
