"""Drift after power-on that changes with temperature, as a table over both (K figure 4.7: `drGX[8][20]`).

    y_i += Σ_j Σ_k c_ijk (share_j(T) − share_j(20 °C)) share_k(t)

Segments j lie between -60, -40 … 80 °C, eight temperatures as K has; segments k between the times of
`drift_curve`, which is the drift at 20 °C: declare both. K's rows follow no line over temperature, which
`drift_curve_temperature` is. Bilinear between the nodes; beyond the first and the last it keeps its value.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

from planner.effects._channels import AXES, REFERENCE_DEGC, side_by_side
from planner.effects._segments import segments_reached, shares
from planner.effects.drift_curve import TIMES_S, DriftCurve
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Sensor, Term

TEMPERATURES_DEGC = (-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0, 80.0)
CURVED = 3  # segments of temperature that the records must reach before a table is more than a line


def warmer(temperature_degc: Array) -> Array:
    """(n, 7) how far each temperature has come through each segment, from 20 °C on."""
    at_room = shares(np.array([REFERENCE_DEGC]), TEMPERATURES_DEGC)
    return np.asarray(shares(temperature_degc, TEMPERATURES_DEGC) - at_room)


@cache
def _terms() -> tuple[Term, ...]:
    """All 189, made once: a diagnosis asks for them three hundred times."""
    return tuple(
        Term(f"{axis} {degc:g} degC {time:g} s")
        for axis in AXES
        for degc in TEMPERATURES_DEGC[1:]
        for time in TIMES_S[1:]
    )


class DriftCurveOverTemperature(DriftCurve):
    """c_ijk, the rise over segment j of temperature of channel i's drift over segment k of time."""

    name = "drift_curve_over_temperature"
    needs = frozenset[Condition](("time_on", "temperature_degc"))
    title = "drift after power-on over temperature and time, as a table"
    equation = "y_i += Σ_jk c_ijk (share_j(T) − share_j(20 °C)) share_k(t)"
    source = "K 2.1, figure 4.7"

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """`x -40 degC 10 s`, … `z 80 degC 3600 s`: channel and the ends of the segments."""
        return _terms()

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(share_j(T) − share_j(20 °C)) share_k(t) on channel i: (n, 3, 189)."""
        over_degc, over_time = warmer(conditions.temperature_degc), shares(conditions.time_on, TIMES_S)
        both = over_degc[:, :, np.newaxis] * over_time[:, np.newaxis, :]
        return side_by_side(both.reshape(len(both), both.shape[1] * both.shape[2]))

    def shows(self, sensor: Sensor, conditions: Conditions) -> bool:
        """Whether the records tell a table from a line over temperature."""
        reached = segments_reached(conditions.temperature_degc, TEMPERATURES_DEGC)
        return reached >= CURVED and super().shows(sensor, conditions)


EFFECT = DriftCurveOverTemperature()
