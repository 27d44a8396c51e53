"""Drift after power-on as a table over time (K 2.1, 2.5.1, table 2.18; figure 4.7: `drGX`).

    y_i += Σ_k c_ik share_k(t),   segments between 0, 10, 30, 60, 120, 300, 600, 1200, 2400 and 3600 s

Zero at power-on, where the bias is the initial one, so that the two are two errors, each with a spread of its
own from power-on to power-on (K table 2.1). A coefficient is the rise of the drift over one segment; from an
hour on, and beyond the longest power-on that was recorded, the drift keeps its last value.
"""

from __future__ import annotations

from collections.abc import Mapping

from planner.effects._channels import AXES, BaseEffect, side_by_side
from planner.effects._segments import segments_reached, shares
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term

TIMES_S = (0.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 2400.0, 3600.0)  # K tables 2.13, 2.18
CURVED = 4  # segments that the records must reach before a table is more than a line or an exponential


class DriftCurve(BaseEffect):
    """c_ik, the rise of channel i's drift over segment k of the time since power-on."""

    name = "drift_curve"
    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "mg"}
    group: Group = "bias"
    needs = frozenset[Condition](("time_on",))
    variable: Condition | None = "time_on"
    title = "drift after power-on, as a table"
    equation = "y_i += Σ_k c_ik share_k(t), segments between 0, 10, 30, … 3600 s"
    source = "K 2.1, 2.5.1, tables 2.1, 2.13, 2.18"
    follows_drift = True

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """`x 10 s`, `x 30 s`, … `z 3600 s`: channel and the segment's end."""
        return tuple(Term(f"{axis} {time:g} s") for axis in AXES for time in TIMES_S[1:])

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """share_k(t) on channel i: (n, 3, 27)."""
        return side_by_side(shares(conditions.time_on, TIMES_S))

    def shows(self, sensor: Sensor, conditions: Conditions) -> bool:
        """Whether the records tell a table from simpler curves: times in several of its segments."""
        return segments_reached(conditions.time_on, TIMES_S) >= CURVED


EFFECT = DriftCurve()
