"""Where the linear combination stops agreeing with the flights: larger errors, longer flights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array
from planner.verify.experiment import Experiment, units_left
from planner.verify.flights import FlightModel, exact_coefficients, looked_at

FACTORS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
SHARES = (0.1, 0.2, 0.4, 0.6, 0.8, 1.0)
UNITS = 50


@dataclass(frozen=True)
class LinearPoint:
    """Errors times `factor`, after `share` of the flight: rms of nonlinear − linear over the rms error.

    size: rms position error, m
    """

    factor: float
    share: float
    apart: float
    size: float


def linearity(e: Experiment, factors: Sequence[float] = FACTORS) -> tuple[LinearPoint, ...]:
    """The errors that calibrated units have left, multiplied; none for published coefficients.

    All of them fly at once: a step of the flight takes about as long for 350 runs as for 50.
    """
    if e.flight is None:
        return ()
    model = _sampled(e.flight)
    coefficients = exact_coefficients(model, units_left(e, 0, UNITS))
    multiplied = [factor * coefficients for factor in factors]
    flown = np.split(model.navigate(np.concatenate(multiplied)).position, len(factors), axis=-1)
    each = zip(factors, multiplied, flown, strict=True)
    return tuple(point for factor, own, position in each for point in _apart(model, own, position, factor))


def _sampled(flight: FlightModel) -> FlightModel:
    """The flight, looked at after shares of it."""
    t = flight.trajectory.time_s
    return looked_at(flight.columns, t[0] + np.array(SHARES) * (t[-1] - t[0]))


def _apart(model: FlightModel, coefficients: Array, flown: Array, factor: float) -> list[LinearPoint]:
    """flown: (k, 3, B) position errors."""
    linear = model.linear.position @ coefficients.T
    with np.errstate(all="ignore"):
        size = np.sqrt(np.mean(np.sum(flown**2, axis=1), axis=1))
        apart = np.sqrt(np.mean(np.sum((flown - linear) ** 2, axis=1), axis=1))
        relative = apart / np.where(size > 0, size, 1.0)
    return [
        LinearPoint(factor, share, float(a), float(s))
        for share, a, s in zip(SHARES, relative, size, strict=True)
    ]
