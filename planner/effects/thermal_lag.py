"""The sensor is behind its thermometer by a lag of first order: y_i += k_i (T − T_b), Ṫ_b = (T − T_b) / τ."""

from __future__ import annotations

from collections.abc import Mapping

from planner.effects._channels import ChannelEffect
from planner.effects._history import changes, lag
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Parameter, Sensor


class ThermalLag(ChannelEffect):
    """k_i, the bias per kelvin that the body is behind; τ = `time_constant` in seconds.

    On an even ramp that is long under way it is k τ dT/dt, the effect temperature_rate.
    """

    name = "thermal_lag"
    units: Mapping[Sensor, str] = {"gyro": "deg/s/K", "accelerometer": "mg/K"}
    group: Group = "bias"
    parameters = (Parameter("time_constant", "s", 300.0, low=30.0, high=3600.0),)
    needs = frozenset[Condition](("temperature_degc", "temperature_rate", "time_on"))
    variable: Condition | None = "temperature_rate"
    history = True
    title = "thermal lag"
    equation = "y_i += k_i (T − T_b), dT_b/dt = (T − T_b) / τ"
    source = "K 2.4"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """T − T_b: (n,) K."""
        return lag(conditions, nonlinear["time_constant"])

    def driven(self, conditions: Conditions) -> bool:
        """Whether the temperature changes while the unit is on: strays of a soaked chamber tell no lag."""
        return changes(conditions)


EFFECT = ThermalLag()
