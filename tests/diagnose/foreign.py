"""A plain unit in which an effect of somebody else's package hides, from plain NumPy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.nouns.dwell_table import DwellTable
from tests.calibrate.world import Layout, campaign

Array = NDArray[np.float64]
LAYOUT = Layout(later=(30.0,), rate_repeats=1, centrifuge=False)
DECLARED = ("bias", "scale_factor", "misalignment")

# (temperature in degC, seconds since power-on, parameters) -> what one unit of the coefficient adds
SHAPES: Mapping[str, Callable[[Array, Array, Mapping[str, float]], Array]] = {
    "self_heating": lambda T, t, p: 1.0 - np.exp(-t / p["time_constant"]),
    "cold_knee": lambda T, t, p: (p["knee_degc"] - T) * (p["knee_degc"] > T),
    "ripple": lambda T, t, p: np.sin(2.0 * np.pi * (T - p["phase"]) / p["period"]),
}


def plain_unit(
    seed: int, effect: str = "", size_dps: float = 0.0, parameters: Mapping[str, float] | None = None
) -> DwellTable:
    """A bench campaign of gyros without curves over temperature; what hides is on gyro y. SI."""
    table = campaign(seed, (), LAYOUT)
    assert table.ref_rate is not None
    rng = np.random.default_rng([seed, 5])
    white = 1.1e-3 * np.sqrt(60.0 / table.duration)[:, None] * rng.normal(size=(len(table), 3))
    run = 2e-3 * rng.normal(size=(int(table.run.max()) + 1, 3))[table.run]
    gyro = 1.001 * table.ref_rate + np.radians(0.02 + run + white)
    if effect:
        shape = SHAPES[effect](table.temperature_degc, table.time_on, parameters or {})
        gyro[:, 1] += np.radians(size_dps) * shape
    return replace(table, gyro=gyro, acc=None)
