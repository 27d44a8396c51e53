"""Ageing: a bias that grows with the days since the calibration, y_i += k_i · day (K 2.5.3, 3.5: storage)."""

from __future__ import annotations

from collections.abc import Mapping

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor
from planner.quantities import DAY_S


class Ageing(ChannelEffect):
    """k_i, the bias per time since the calibration (SI: per second; the conditions count days)."""

    name = "ageing"
    units: Mapping[Sensor, str] = {"gyro": "deg/s/day", "accelerometer": "g/day"}
    group: Group = "bias"
    needs = frozenset[Condition](("day",))
    variable: Condition | None = "day"
    title = "ageing"
    equation = "y_i += k_i · day"
    source = "K 2.5.3, 3.5"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """Seconds since the calibration: (n,)."""
        return conditions.day * DAY_S


EFFECT = Ageing()
