"""Drift after the initial bias, as large as each power-on draws it: y_i += k_i (1 − exp(−t / τ)) (K 2.1).

The bias is that of the first seconds; soon after it the unit settles at another. K finds the spread of both
about equal (table 2.1) and that of the drift there within ten seconds (tables 2.13, 2.15): two errors, each
with its own `run_to_run`. The mean of k_i is calibrated like any other; a mean that goes on changing over the
hour is for `drift_curve`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import ChannelEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Parameter, Sensor

SLOWEST_S = 60.0  # time constant; what takes longer is a `warm_up`, which is the same but for a constant
LEFT = 3.0  # time constants, after which a twentieth is left to be seen


class Settling(ChannelEffect):
    """k_i, from the initial bias to the one after it has settled; τ = `time_constant` in seconds."""

    name = "settling"
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}
    group: Group = "bias"
    parameters = (Parameter("time_constant", "s", 5.0, low=0.5, high=SLOWEST_S),)
    needs = frozenset[Condition](("time_on",))
    variable: Condition | None = "time_on"
    title = "drift after the initial bias"
    equation = "y_i += k_i (1 − exp(−t / τ))"
    source = "K 2.1, tables 2.1, 2.15"

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """1 − exp(−t / τ), t since power-on: (n,)."""
        return -np.expm1(-conditions.time_on / nonlinear["time_constant"])

    def shows(self, sensor: Sensor, conditions: Conditions) -> bool:
        """Whether records begin before the slowest settling is over, and go on after that."""
        over = LEFT * SLOWEST_S
        return bool(np.any(conditions.time_on < over) and np.any(conditions.time_on > SLOWEST_S))


EFFECT = Settling()
