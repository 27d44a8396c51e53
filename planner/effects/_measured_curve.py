"""Curves without a name of their own: what a residual follows, as measured, y_i += Σ_k c_k h_k(conditions).

The effect's name says all that its columns need, so that every room that asks the catalogue can carry it:

    curve_gyro_y_over_time_on_at_30_120_400        hat functions over 30, 120 and 400 s, on gyro y alone
    curve_acc_x_over_specific_force                fixed columns: |f_j|, f_j², f_j³ along each axis, f at 50 g

`m` stands for minus, `p` for the point. What the constant and the scale factor can take up is left out of the
columns: a node at which the curve is zero, for rates two. Beyond its outer nodes a curve keeps its value.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Literal

import numpy as np

from planner.effects._channels import AXES, BaseEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.physics.attitude import unit
from planner.protocols import Condition, Group, Sensor, Term
from planner.units import STANDARD_GRAVITY_MPS2

PATTERN = r"curve_(gyro|acc)_([xyz])_over_([a-z_]+?)(?:_at_((?:m?\d+(?:p\d+)?)(?:_m?\d+(?:p\d+)?)*))?"
LEAST_NODES, MOST_NODES = 2, 12
_FULL_G, _FULL_RATE, _SPAN_K = 50.0, float(np.radians(500.0)), 60.0
_SHORT: Mapping[str, Sensor] = {"gyro": "gyro", "acc": "accelerometer"}

Dropped = Literal["first", "zero", "zero and end"]
Columns = Callable[[Conditions, int], Array]


@dataclass(frozen=True)
class Variable:
    """What a curve may run over.

    needs: of the conditions; of: (conditions, axis) -> (n, m), hat functions over each of the m, or with
        `dropped` empty the columns themselves; unit: of the nodes, `scale` SI for each
    dropped: the node at which the curve is zero, as the constant takes that up; `zero and end`: a chord too
    sensors: on which it can be
    """

    needs: tuple[Condition, ...]
    of: Columns
    unit: str = ""
    scale: float = 1.0
    dropped: Dropped | None = None
    sensors: tuple[Sensor, ...] = ("gyro", "accelerometer")


def _modulus(conditions: Conditions, axis: int) -> Array:
    return np.asarray(np.linalg.norm(conditions.rate, axis=1, keepdims=True))


def _load(conditions: Conditions, axis: int) -> Array:
    """|f_j|, f_j², f_j³ along each axis, f in 50 g: (n, 9)."""
    f = conditions.specific_force / (_FULL_G * STANDARD_GRAVITY_MPS2)
    return np.concatenate([np.abs(f), f**2, f**3], axis=1)


def _ways_up(conditions: Conditions, axis: int) -> Array:
    """The share of each way up but the first, (f_j / |f|)² on its side: (n, 5); all six are a constant."""
    up = unit(conditions.specific_force)
    ways = np.stack([np.where(s * up > 0.0, up**2, 0.0) for s in (1.0, -1.0)], axis=2).reshape(-1, 6)
    return np.asarray(ways[:, 1:])


def _warm(conditions: Conditions) -> Array:
    """(n, 2) t and t², t in 60 K from 20 °C."""
    t = (conditions.temperature_degc - 20.0) / _SPAN_K
    return np.column_stack([t, t**2])


def _ways_up_warm(conditions: Conditions, axis: int) -> Array:
    return _products(_ways_up(conditions, axis), _warm(conditions))


def _rate_warm(conditions: Conditions, axis: int) -> Array:
    """|ω_i|, ω_i³, and |ω_j|, ω_j of the other axes, times t and t²: (n, 12); ω in 500 °/s."""
    w = conditions.rate / _FULL_RATE
    others = np.delete(w, axis, axis=1)
    own = w[:, [axis]]
    return _products(np.concatenate([np.abs(own), own**3, np.abs(others), others], axis=1), _warm(conditions))


def _products(a: Array, b: Array) -> Array:
    return np.asarray((a[:, :, None] * b[:, None, :]).reshape(len(a), a.shape[1] * b.shape[1]))


_DPS = float(np.radians(1.0))
VARIABLES: Mapping[str, Variable] = {
    "time_on": Variable(("time_on",), lambda c, a: c.time_on[:, None], "s", 1.0, "first"),
    "day": Variable(("day",), lambda c, a: c.day[:, None], "day", 1.0, "first"),
    "temperature_rate": Variable(
        ("temperature_rate",), lambda c, a: c.temperature_rate[:, None], "K/min", 1.0 / 60.0, "zero"
    ),
    "rate": Variable(("rate",), lambda c, a: c.rate[:, [a]], "deg/s", _DPS, "zero and end", ("gyro",)),
    "rate_modulus": Variable(("rate",), _modulus, "deg/s", _DPS, "first", ("gyro",)),
    "cross_rate": Variable(
        ("rate",), lambda c, a: np.delete(c.rate, a, axis=1), "deg/s", _DPS, "zero and end", ("gyro",)
    ),
    "specific_force": Variable(("specific_force",), _load),
    "orientation": Variable(("specific_force",), _ways_up),
    "temperature": Variable(("specific_force", "temperature_degc"), _ways_up_warm),
    "temperature_and_rate": Variable(("rate", "temperature_degc"), _rate_warm, sensors=("gyro",)),
}
FORMS: Mapping[str, tuple[str, ...]] = {"rate": ("rate", "rate_modulus", "cross_rate")}
"""What the search calls one variable -> the curves over it, where there are several."""


class MeasuredCurve(BaseEffect):
    """c_k, what was measured at a node of the variable, on one channel; nodes in the variable's unit."""

    group: Group = "bias"

    def __init__(self, sensor: Sensor, axis: int, over: str, nodes: tuple[float, ...]) -> None:
        self.sensor, self.axis, self.over, self.nodes = sensor, axis, over, nodes
        self.name = curve_name(sensor, axis, over, nodes)
        self.sensors: tuple[Sensor, ...] = (sensor,)
        self.units: Mapping[Sensor, str] = {sensor: "deg/s" if sensor == "gyro" else "g"}
        v = VARIABLES[over]
        self.needs = frozenset(v.needs)
        self.variable: Condition | None = v.needs[0]
        self.title = f"measured curve over {over.replace('_', ' ')}"
        self.equation = "y_i += Σ_k c_k h_k"
        self.source = "the unit's own records"
        self._width = self._columns(_nowhere()).shape[1]

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """One a column: `y_at_50`, with its node; of two variables `y_2_at_50`; without nodes `y_1`, …"""
        own, kept = AXES[self.axis], self._kept()
        sets = self._width // len(kept) if kept else 0
        if sets < 1:
            return tuple(Term(f"{own}_{k + 1}") for k in range(self._width))
        which = [""] if sets == 1 else [f"_{j + 1}" for j in range(sets)]
        return tuple(Term(f"{own}{j}_at_{_written(self.nodes[k])}") for j in which for k in kept)

    def _kept(self) -> list[int]:
        """The nodes that have a column."""
        dropped = VARIABLES[self.over].dropped
        gone = _left_out(np.array(self.nodes), dropped) if dropped else set()
        return [k for k in range(len(self.nodes)) if k not in gone]

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(n, 3, k) the columns on the one channel."""
        columns = self._columns(conditions)
        out = np.zeros((len(columns), 3, columns.shape[1]))
        out[:, self.axis] = columns
        return out

    def _columns(self, conditions: Conditions) -> Array:
        v = VARIABLES[self.over]
        values = v.of(conditions, self.axis)
        if v.dropped is None:
            return values
        nodes = np.array(self.nodes) * v.scale
        each = [np.interp(x, nodes, np.eye(len(nodes))[k]) for x in values.T for k in self._kept()]
        return np.stack(each, axis=1) if each else np.empty((len(values), 0))


def _left_out(nodes: Array, dropped: Dropped) -> set[int]:
    if dropped == "first":
        return {0}
    zero = int(np.argmin(np.abs(nodes)))
    if dropped == "zero":
        return {zero}
    ends = [k for k in (0, len(nodes) - 1) if k != zero]
    return {zero, max(ends, key=lambda k: abs(float(nodes[k])))}


def _nowhere() -> Conditions:
    row = np.zeros(1)
    return Conditions(np.zeros((1, 3)), np.zeros((1, 3)), row, row, row, row)


# ---------------------------------------------------------------- names


def curve_name(sensor: Sensor, axis: int, over: str, nodes: tuple[float, ...] = ()) -> str:
    """`curve_gyro_y_over_time_on_at_30_120_400`."""
    short = "gyro" if sensor == "gyro" else "acc"
    at = "_at_" + "_".join(_written(x) for x in nodes) if nodes else ""
    return f"curve_{short}_{AXES[axis]}_over_{over}{at}"


def _written(x: float) -> str:
    return f"{x:.4f}".rstrip("0").rstrip(".").replace("-", "m").replace(".", "p")


@lru_cache(maxsize=1024)  # fits name new nodes for as long as a process diagnoses
def curve_of(name: str) -> MeasuredCurve | None:
    """The curve that a name describes; None where it describes none."""
    match = re.fullmatch(PATTERN, name)
    if match is None or match[3] not in VARIABLES:
        return None
    v, sensor = VARIABLES[match[3]], _SHORT[match[1]]
    nodes = tuple(float(x.replace("m", "-").replace("p", ".")) for x in (match[4] or "").split("_") if x)
    rising = all(a < b for a, b in pairwise(nodes))
    enough = (
        LEAST_NODES + (v.dropped == "zero and end") <= len(nodes) <= MOST_NODES if v.dropped else not nodes
    )
    if sensor not in v.sensors or not rising or not enough:
        return None
    return MeasuredCurve(sensor, AXES.index(match[2]), match[3], nodes)
