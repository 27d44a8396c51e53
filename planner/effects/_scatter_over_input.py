"""What one power-on adds to a scale factor at some inputs more than at others (K 2.5.2, table 2.17).

    y_i += w_i share(|u_i|) u_i,   share linear between the inputs of the spec's table, kept beyond them

A spec writes it as a spread of the scale factor, `run_to_run: {10 deg/s: 0.107 %, 500 deg/s: 0.122 %}`
(planner.spec.scatter). It is drawn anew in flight, so that nothing is calibrated of it.

The effect's name says all that its column needs, so that every room that asks the catalogue can carry it:

    scatter_over_input_at_10_500_of_0_1       shares 0 and 1 at 10 and 500 deg/s, or g
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise

import numpy as np

from planner.effects._channels import ChannelEffect, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor
from planner.units import STANDARD_GRAVITY_MPS2

PREFIX = "scatter_over_input"
_NUMBERS = r"\d+(?:p\d+)?(?:_\d+(?:p\d+)?)*"
_PATTERN = rf"{PREFIX}_at_({_NUMBERS})_of_({_NUMBERS})"
INPUT_UNIT: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}
_SCALE: Mapping[Sensor, float] = {"gyro": float(np.radians(1.0)), "accelerometer": STANDARD_GRAVITY_MPS2}


class ScatterOverInput(ChannelEffect):
    """w_i, what a power-on draws of the scale factor beside what all inputs share, where the share is 1."""

    units: Mapping[Sensor, str] = {"gyro": "1", "accelerometer": "1"}
    group: Group = "scale_factor"
    needs = frozenset[Condition](("rate", "specific_force"))
    variable: Condition | None = "rate"
    title = "scale factor from power-on to power-on, over the input"
    equation = "y_i += w_i share(|u_i|) u_i"
    source = "K 2.5.2, table 2.17"

    def __init__(self, inputs: tuple[float, ...], shares: tuple[float, ...]) -> None:
        self.inputs, self.shares = inputs, shares
        self.name = scatter_name(inputs, shares)

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """share(|u_i|) u_i: (n, 3)."""
        u = sensed(sensor, conditions)
        return np.asarray(u * np.interp(np.abs(u) / _SCALE[sensor], self.inputs, self.shares))


def scatter_name(inputs: tuple[float, ...], shares: tuple[float, ...]) -> str:
    """`scatter_over_input_at_10_500_of_0_1`; inputs in deg/s or g."""
    at, of = ("_".join(map(_written, values)) for values in (inputs, shares))
    return f"{PREFIX}_at_{at}_of_{of}"


def _written(x: float) -> str:
    return f"{x:.5f}".rstrip("0").rstrip(".").replace(".", "p")


@lru_cache(maxsize=1024)  # fits name new nodes for as long as a process diagnoses
def scatter_of(name: str) -> ScatterOverInput | None:
    """The effect that a name describes; None where it describes none."""
    match = re.fullmatch(_PATTERN, name)
    if match is None:
        return None
    inputs, shares = (tuple(float(x.replace("p", ".")) for x in part.split("_")) for part in match.groups())
    if len(inputs) != len(shares) or not all(a < b for a, b in pairwise(inputs)):
        return None
    return ScatterOverInput(inputs, shares)
