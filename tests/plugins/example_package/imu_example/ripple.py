"""Ripple of the bias over temperature, y_i += k_i sin(2π (T − φ) / P)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects import ChannelEffect, Condition, Group, Parameter, Sensor
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions


class Ripple(ChannelEffect):
    """k_i, the amplitude; P = `period` in kelvins, φ = `phase` in degrees Celsius."""

    name = "ripple"
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}
    group: Group = "bias"
    parameters = (
        Parameter("period", "K", 60.0, low=20.0, high=200.0),
        Parameter("phase", "degC", 5.0, low=-40.0, high=40.0, scale="linear"),
    )
    needs = frozenset[Condition](("temperature_degc",))
    variable: Condition | None = "temperature_degc"
    title = "ripple over temperature"
    equation = "y_i += k_i sin(2π (T − φ) / P)"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """(n,) sin(2π (T − φ) / P)."""
        turns = (conditions.temperature_degc - nonlinear["phase"]) / nonlinear["period"]
        return np.sin(2.0 * np.pi * turns)


EFFECT = Ripple()
