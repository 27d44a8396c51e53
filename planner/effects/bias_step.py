"""Step of the bias between two days, after a shock, a repair, a removal, y_i += k_i [day >= d] (K 3.5)."""

from __future__ import annotations

from collections.abc import Mapping

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Parameter, Sensor


class BiasStep(ChannelEffect):
    """k_i, by how much the bias is another from day d on; d = `day` in days since the calibration."""

    name = "bias_step"
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}
    group: Group = "bias"
    parameters = (Parameter("day", "day", 30.0, low=0.5, high=600.0, stepped=True),)
    needs = frozenset[Condition](("day",))
    variable: Condition | None = "day"
    title = "step of the bias"
    equation = "y_i += k_i [day >= d]"
    source = "K 3.5"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """1 from day d on, 0 before: (n,)."""
        return (conditions.day >= nonlinear["day"]).astype(float)


EFFECT = BiasStep()
