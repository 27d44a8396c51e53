"""The nouns of a calibration: coefficients with what is known of them, and the tables that correct a reading.

SI and radians inside, temperatures in degrees Celsius. The measurement equation is
y_i = (1 + κ_i)·(M u)_i + b_i + noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from planner.nouns.array import Array

NORMAL_DEGC = 20.0
Status = Literal["determined", "weak", "undetermined"]


@dataclass(frozen=True)
class Coefficient:
    """One estimated number of one sensor, SI.

    error: `gyro.bias`; channel: x, y or z; term: the effect's own name of it, e.g. `xy`
    temperature_degc: the node of a temperature table, else None; unit: display unit
    low, high: 95 % interval; freedom: its degrees of freedom
    status: `weak` when the interval is wider than the error's whole budget; `undetermined` when the data
        hold no information (the value is then only one of many that fit, and nobody should quote it)
    """

    error: str
    channel: str
    term: str
    temperature_degc: float | None
    unit: str
    value: float
    standard_error: float
    freedom: float
    low: float
    high: float
    status: Status


@dataclass(frozen=True)
class RandomCharacteristic:
    """One spread of one channel, SI, with its 95 % interval (NaN where it is not determined).

    kind: `white` (one record), `white_density` (per root hertz), `rate_noise` (per unit of input),
        `run_to_run`, `in_run`, `storage`; of the samples of a recording `white_density_of_samples`,
        `coloured` and `coloured_correlation_time`; error: what it spreads, e.g. `gyro.bias`
    """

    kind: str
    error: str
    channel: str
    unit: str
    value: float
    low: float
    high: float
    freedom: float
    measured: bool = True


@dataclass(frozen=True)
class Residual:
    """Root mean square of what is left on one channel, SI, before and after the correction.

    held_out: on runs that the fit has not seen; rows, runs: how many went in; how: in words
    """

    channel: str
    before: float
    after: float
    in_sample: float
    held_out: bool
    rows: int
    runs: int
    how: str


@dataclass(frozen=True)
class ExtraTerm:
    """A term outside the tables: an effect's coefficient with its nonlinear parameters, SI."""

    effect: str
    term: str
    value: float
    nonlinear: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Tables:
    """What corrects one sensor.

    temperature_degc: (N,); bias, scale: (3, N) b_i and κ_i at the nodes, piecewise linear between them
    asymmetry: (3,) slope for + input minus slope for − input; misalignment: (3, 3) M
    reach: kelvins beyond the end nodes over which the end segments are continued; constant from there
    """

    temperature_degc: Array
    bias: Array
    scale: Array
    asymmetry: Array
    misalignment: Array
    extra: tuple[ExtraTerm, ...] = ()
    reach: float = 5.0

    @property
    def fallback_degc(self) -> float:
        """Where the tables are taken while no temperature is measured: normal conditions (K 4.3.2)."""
        return float(np.clip(NORMAL_DEGC, self.temperature_degc[0], self.temperature_degc[-1]))

    @property
    def without_temperature(self) -> float:
        """SI: by how much the bias at some node differs from that at the fallback, at most."""
        nodes = self.temperature_degc
        here = np.array([np.interp(self.fallback_degc, nodes, b) for b in self.bias])
        return float(np.abs(self.bias - here[:, None]).max())


@dataclass(frozen=True)
class SmoothTable:
    """One channel's table by the posterior mean of its curve, SI.

    temperature_degc, value, standard_error, low, high: (N,) with 95 % intervals
    size: how large the unit's curves are beside the spec's table of residuals, with its 95 % interval
    between_degc, missed: (F,) what straight lines between the N nodes miss of it
    """

    error: str
    channel: str
    term: str
    unit: str
    temperature_degc: Array
    value: Array
    standard_error: Array
    low: Array
    high: Array
    size: tuple[float, float, float]
    between_degc: Array
    missed: Array


@dataclass(frozen=True)
class SensorCalibration:
    """Everything found for the three channels of one sensor.

    condition: channel -> condition number of its design; covariance: channel -> (p, p) in the order of that
    channel's coefficients; smooth: where the spec asks for them, what `tables` then hold
    """

    sensor: Literal["gyro", "accelerometer"]
    method: str
    coefficients: tuple[Coefficient, ...]
    covariance: Mapping[str, Array]
    condition: Mapping[str, float]
    tables: Tables
    residuals: tuple[Residual, ...]
    random: tuple[RandomCharacteristic, ...]
    notes: tuple[str, ...] = ()
    smooth: tuple[SmoothTable, ...] = ()


@dataclass(frozen=True)
class Calibration:
    """The calibration of one unit. sha256: of the spec's file; source: the data's file."""

    unit: str
    version: str
    source: str
    spec_name: str
    spec_sha256: str
    sensors: tuple[SensorCalibration, ...]
    notes: tuple[str, ...] = ()
