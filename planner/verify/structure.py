"""How an effect enters the readings, asked of its regressors: a constant, something proportional, or neither.

A constant, and what is proportional to the sensor's own input, make û = A u + c of a corrected reading, which
is exact; anything else (g-sensitivity, |u|, what changes with time) is kept to first order by its own
regressors along the flight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Group, Sensor
from planner.verify.declared import INPUT

_PROBES = 8


@dataclass(frozen=True)
class Affine:
    """Output (3,) of coefficients θ at input u: (constant + Σ_j u_j slope_j) θ.

    constant: (3, t); slope: (3, 3, t), of output i by input j; group: where it enters the equation
    """

    group: Group
    constant: Array
    slope: Array


def affine(sensor: Sensor, effect: str) -> Affine | None:
    """The effect as a constant and slopes; None for one that depends on anything else."""
    known = catalog.effects()[effect]
    at = _probes(sensor)
    found = known.regressors(sensor, at)
    constant = found[0]
    slope = np.stack([found[1 + j] - constant for j in range(3)], axis=1)
    u = getattr(at, INPUT[sensor])
    expected = constant + np.einsum("ijt,nj->nit", slope, u)
    if not np.allclose(found, expected, rtol=1e-9, atol=1e-12):
        return None
    return Affine(known.group, constant, slope)


def _probes(sensor: Sensor) -> Conditions:
    """No input, one on each axis, then any input under any circumstances."""
    rng = np.random.default_rng(0)  # any will do, the same every time
    n = 4 + _PROBES
    inputs = np.concatenate([np.zeros((1, 3)), np.eye(3), rng.normal(size=(_PROBES, 3))])
    other = np.concatenate([np.zeros((4, 3)), 10.0 * rng.normal(size=(_PROBES, 3))])
    gyro = sensor == "gyro"
    return Conditions(
        rate=inputs if gyro else other,
        specific_force=other if gyro else inputs,
        temperature_degc=np.concatenate([np.full(4, 20.0), rng.uniform(-60.0, 80.0, n - 4)]),
        temperature_rate=np.concatenate([np.zeros(4), rng.normal(size=n - 4)]),
        time_on=np.concatenate([np.full(4, 60.0), rng.uniform(1.0, 5000.0, n - 4)]),
        day=np.concatenate([np.zeros(4), rng.uniform(0.0, 100.0, n - 4)]),
    )
