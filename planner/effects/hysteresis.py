"""The bias depends on the side from which the temperature was reached, y_i += k_i s / 2, s = ±1."""

from __future__ import annotations

from collections.abc import Mapping

from planner.effects._channels import ChannelEffect
from planner.effects._history import direction
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor


class Hysteresis(ChannelEffect):
    """k_i, from the falling to the rising branch of the temperature; it stays while that stands."""

    name = "hysteresis"
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "mg"}
    group: Group = "bias"
    needs = frozenset[Condition](("temperature_degc", "temperature_rate"))
    variable: Condition | None = "temperature_rate"
    history = True
    title = "hysteresis over temperature"
    equation = "y_i += k_i s / 2, s = ±1 as the temperature last rose or fell"
    source = "IEEE Std 1293, hysteresis error"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """s / 2: (n,)."""
        return direction(conditions) / 2.0


EFFECT = Hysteresis()
