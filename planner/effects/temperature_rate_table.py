"""Bias over temperature and its rate, a table with straight lines between its nodes (K 2.4.2, table 2.11)."""

from __future__ import annotations

from planner.effects._rate_table import RateTable

TEMPERATURES_DEGC = (-60.0, -20.0, 0.0, 20.0, 40.0, 60.0)  # the nodes of K table 2.11
RATES_K_MIN = (-2.0, 2.0)


class TemperatureRateTable(RateTable):
    """By how much the bias at T and dT/dt differs from that at a steady T.

    Where the table is the same at every temperature and its sides are opposite, it is k_i dT/dt, the effect
    temperature_rate; where it follows no rate but its sign, hysteresis looks alike.
    """

    name = "temperature_rate_table"
    title = "bias over temperature and its rate"
    equation = "y_i += Σ c_ijk h_j(T) h_k(dT/dt), linear between the nodes, 0 at dT/dt = 0"
    source = "K 2.4.2, tables 2.11 and 2.12"


EFFECT = TemperatureRateTable(TEMPERATURES_DEGC, RATES_K_MIN)
