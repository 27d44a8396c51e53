"""Gyro bias over acceleration as a table, K 2.2.6, eq. 21: piecewise linear over 0 … 100 g, + and − apart.

    y_i += Σ_j (c_ij0 clip(f_j / 5 g, ±1) + Σ_± Σ_k c_ij±k share_k(±f_j))

Segments lie between 5, 10, 25, 50 and 100 g; below 5 g it is one line through zero for both directions, so
that six faces at 1 g tell a slope and not six offsets.

K measures ω_far − ω_centre at one rate near to and far from the axis of a centrifuge, six faces, 10 repeats:
.08-.12 deg/s before, .011-.017 deg/s after (table 2.5). Straight lines (`g_sensitivity`) follow no profile
that saturates. It holds the straight line: declare one of the two.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._channels import AXES, BaseEffect, side_by_side
from planner.effects._segments import segments_reached, shares
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term
from planner.units import STANDARD_GRAVITY_MPS2

LOADS_G = (0.0, 5.0, 10.0, 25.0, 50.0, 100.0)  # of K's eight loads (table 2.4), denser where profiles bend
SIGNS = (1.0, -1.0)
CURVED = 3  # segments that the loads must reach before a table is more than a straight line and a square


class LoadCurve(BaseEffect):
    """c_ij±k, the rise of gyro i's bias over segment k of the load along body axis j, one way."""

    name = "load_curve"
    sensors: tuple[Sensor, ...] = ("gyro",)
    units: Mapping[Sensor, str] = {"gyro": "deg/s"}
    group: Group = "bias"
    needs = frozenset[Condition](("specific_force",))
    variable: Condition | None = "specific_force"
    title = "bias over load, as a table"
    equation = "y_i += Σ_j (c_ij0 clip(f_j / 5 g, ±1) + Σ_± Σ_k c_ij±k share_k(±f_j)), to 10, 25, 50, 100 g"
    source = "K 2.2.6, eq. 21, table 2.5"

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """`xx 5 g`, `xx +10 g`, … `zz -100 g`: channel, axis and direction of the load, segment's end."""
        ends = [f"{LOADS_G[1]:g} g", *(f"{sign * load:+g} g" for sign in SIGNS for load in LOADS_G[2:])]
        return tuple(Term(f"{channel}{axis} {end}") for channel in AXES for axis in AXES for end in ends)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """clip(f_j / 5 g, ±1) and share_k(±f_j) on channel i: (n, 3, 81)."""
        loads = conditions.specific_force / STANDARD_GRAVITY_MPS2
        line = np.clip(loads / LOADS_G[1], -1.0, 1.0)[..., np.newaxis]  # (n, 3, 1)
        drives = [line, *(shares(sign * loads, LOADS_G[1:]) for sign in SIGNS)]
        every = np.concatenate(drives, axis=2)
        return side_by_side(every.reshape(len(loads), every.shape[1] * every.shape[2]))

    def shows(self, sensor: Sensor, conditions: Conditions) -> bool:
        """Whether the records tell a table from simpler curves: loads in several of its segments."""
        loads = np.abs(conditions.specific_force).max(axis=1, initial=0.0) / STANDARD_GRAVITY_MPS2
        return segments_reached(loads, LOADS_G) >= CURVED


EFFECT = LoadCurve()
