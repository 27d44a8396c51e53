"""Drift after power-on that changes with temperature: y_i += (T − 20 °C) Σ_k c_ik share_k(t) (K figure 4.7).

K's firmware holds the drift over temperature and time, `drGX[8][20]`; this is the part linear in temperature,
with the times of `drift_curve`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import REFERENCE_DEGC
from planner.effects.drift_curve import DriftCurve
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Sensor


class DriftCurveTemperature(DriftCurve):
    """c_ik, the change per kelvin of the rise of channel i's drift over segment k."""

    name = "drift_curve_temperature"
    units: Mapping[Sensor, str] = {"gyro": "deg/s/K", "accelerometer": "mg/K"}
    needs = frozenset[Condition](("time_on", "temperature_degc"))
    title = "drift after power-on over temperature, as a table"
    equation = "y_i += (T − 20 °C) Σ_k c_ik share_k(t)"
    source = "K 2.1, figure 4.7"

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(T − 20 °C) share_k(t) on channel i: (n, 3, 27)."""
        warmer = conditions.temperature_degc[:, np.newaxis, np.newaxis] - REFERENCE_DEGC
        return np.asarray(warmer * super().regressors(sensor, conditions, nonlinear))


EFFECT = DriftCurveTemperature()
