"""Bias over temperature, its rate and the time since power-on, a table of three axes (K 2.4.2)."""

from __future__ import annotations

from planner.effects._rate_table import RateTable
from planner.effects.temperature_rate_table import RATES_K_MIN, TEMPERATURES_DEGC

TIMES_S = (0.0, 1800.0)  # power-on, and when a unit of K's has warmed up


class TemperatureRateTableOverTime(RateTable):
    """As temperature_rate_table, with values of its own at power-on and half an hour after it."""

    name = "temperature_rate_table_over_time"
    title = "bias over temperature, its rate and time since power-on"
    equation = "y_i += Σ c_ijkl h_j(T) h_k(dT/dt) h_l(t), linear between the nodes, 0 at dT/dt = 0"
    source = "K 2.4.2, its last equation"


EFFECT = TemperatureRateTableOverTime(TEMPERATURES_DEGC, RATES_K_MIN, TIMES_S)
