"""A table of the bias over temperature, its rate and, where asked, the time since power-on (K 2.4.2)."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from planner.effects._channels import AXES, BaseEffect, side_by_side
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Group, Sensor, Term
from planner.temperature_table import hats

MINUTE_S = 60.0


class RateTable(BaseEffect):
    """c at the nodes of a grid, by how much the bias differs from that at a steady temperature.

        y_i += Σ_jkl c_ijkl h_j(T) h_k(dT/dt) h_l(t)

    h are the hat functions of the nodes, so that the table is linear between neighbours along every axis. The
    node of the rate 0 is no coefficient: there the bias is that of the steady temperature. Beyond its last
    rates the table goes on along its end segments; beyond its temperatures and times it stays.

    temperatures: degC; rates: K/min, on either side of 0; times: s since power-on, none for a table that has
        no such axis. All rise.
    Raises ValueError for nodes that do not rise, a rate of 0 and rates on one side of it.
    """

    units: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "mg"}
    group: Group = "bias"
    variable: Condition | None = "temperature_rate"
    nodal = True
    follows_drift = True

    def __init__(
        self, temperatures: tuple[float, ...], rates: tuple[float, ...], times: tuple[float, ...] = ()
    ) -> None:
        for nodes in (temperatures, rates, times):
            if any(b <= a for a, b in pairwise(nodes)):
                raise ValueError(f"the nodes {nodes} do not rise")
        if not temperatures or 0.0 in rates or not min(rates) < 0.0 < max(rates):
            raise ValueError("a table needs a temperature, and rates below and above 0, which is no node")
        self.temperatures, self.rates, self.times = temperatures, rates, times
        asked: tuple[Condition, ...] = ("temperature_degc", "temperature_rate", "time_on")
        self.needs = frozenset(
            asked[k] for k in range(3) if k == 1 or len((temperatures, rates, times)[k]) > 1
        )

    @property
    def nodes(self) -> tuple[tuple[float, float, float | None], ...]:
        """(temperature, rate, time) of a channel's coefficients, in their order."""
        return tuple(
            (T, r, t) for t in (self.times or (None,)) for T in self.temperatures for r in self.rates
        )

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """`x -60 degC -2 K/min`, with a time axis `x -60 degC -2 K/min 600 s`: channel by channel."""
        return tuple(Term(f"{axis} {_name(*node)}") for axis in AXES for node in self.nodes)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(n, 3, 3m) weights of the m nodes, each on its channel."""
        n = len(conditions.day)
        around = np.array(sorted((*self.rates, 0.0)))
        rate = hats(conditions.temperature_rate * MINUTE_S, around, np.inf)[:, around != 0.0]
        degc = hats(conditions.temperature_degc, np.array(self.temperatures), 0.0)
        time = hats(conditions.time_on, np.array(self.times), 0.0) if self.times else np.ones((n, 1))
        weights = time[:, :, None, None] * degc[:, None, :, None] * rate[:, None, None, :]
        return side_by_side(weights.reshape(n, len(self.nodes)))


def _name(temperature: float, rate: float, time: float | None) -> str:
    at = f"{temperature:g} degC {rate:+g} K/min"
    return at if time is None else f"{at} {time:g} s"
