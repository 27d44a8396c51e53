"""Many campaigns of one plan at once: measured, and calibrated by the estimator of `planner calibrate`.

One channel's coefficients are generalised least squares on the product model y = (1 + κ) v + b, v = u + L m,
with the noise that the spec gives. Whitening and the design's inverse are worked out once,
P = (XᵀV⁻¹X)⁻¹XᵀV⁻¹; every unit then costs matrix products, θ ← θ + P (y − ŷ(θ)), which is
Gauss-Newton with the Jacobian at zero: it contracts by κ, 0.5 % a round. Where the records hardly determine
a coefficient it need not contract; then the first, linear solution stays, which is as useless as any that
fits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.errors import InputError
from planner.learn.channel_model import ChannelModel, channel_model, evaluate, jacobian, sensed
from planner.learn.noise_model import Noise, noise_model, spec_variances
from planner.protocols import SENSORS, Sensor
from planner.records import Array, Conditions
from planner.sensor import ErrorName
from planner.simulate.campaign import Settings
from planner.simulate.design import Design
from planner.solvers.least_squares import factors
from planner.solvers.random_effects import covariance
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec
from planner.verify.draws import DrawnError, generator

_ROUNDS = 5  # 0.5 % of scale factor to the fifth is nothing
_DRIVE = {"gyro": "rate", "accelerometer": "specific_force"}


@dataclass(frozen=True)
class ChannelEstimator:
    """One channel: its model at nominal conditions and P (p, n).

    error: (p,) standard errors by the spec's noise; undetermined: (p,) which no record tells from the others
    """

    model: ChannelModel
    inverse: Array
    error: Array
    undetermined: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """How many linear coefficients; nonlinear parameters stay at their defaults."""
        return len(self.inverse)


def estimators(design: Design, spec: Spec, settings: Settings) -> dict[Sensor, tuple[ChannelEstimator, ...]]:
    """The three channels of both sensors. Raises InputError for fewer records than coefficients."""
    return {
        sensor: tuple(_estimator(sensor, channel, design, spec, settings) for channel in range(3))
        for sensor in SENSORS
    }


def _estimator(
    sensor: Sensor, channel: int, design: Design, spec: Spec, settings: Settings
) -> ChannelEstimator:
    model = channel_model(sensor, channel, design.conditions, spec.effects)
    start = model.start()
    parts = evaluate(model, start)
    X = jacobian(model, start, parts)[:, : len(start) - len(model.parameters())]
    if X.shape[1] >= len(X):
        raise InputError(
            f"{len(X)} records of the plan cannot give the {X.shape[1]} coefficients of {sensor} "
            f"{'xyz'[channel]}; plan more records, or declare fewer effects"
        )
    noise = noise_model(model, parts, design.starts, design.duration, spec, np.ones(len(X)))
    white = settings.white[sensor] ** 2 / noise.duration
    v = covariance(noise.effects, _variances(noise, spec, white))
    found = factors(v.whiten(X))
    inverse = v.whiten_transposed(found.basis @ found.to_coefficients.T).T
    error = np.sqrt(np.sum(found.to_coefficients**2, axis=1))
    return ChannelEstimator(model, np.ascontiguousarray(inverse), error, found.undetermined())


def _variances(noise: Noise, spec: Spec, white: float) -> Array:
    """Variances by the spec: its run-to-run and noise, and for the drift of a scale factor its in-run part.

    `planner calibrate` finds the last one in the data: at 400 deg/s a drift of 20 ppm is 30 deg/h, and a fit
    that knew nothing of it would believe turns about the bias.
    """
    found = spec_variances(noise, spec, white).theta.copy()
    for i, component in enumerate(noise.components):
        if component.kind == "rate_noise":
            sensor, effect = ErrorName(component.error).parts
            budget: ErrorBudget | None = getattr(spec.unit, sensor).get(effect)
            found[i] = 0.0 if budget is None else budget.in_run_sigma**2
    return np.asarray(found)


# ---------------------------------------------------------------- measuring


def conditions_of_units(design: Design, units: int, settings: Settings, key: tuple[int, int]) -> Conditions:
    """Conditions of B · n records, unit after unit: the chamber strays around the soaked temperature."""
    nominal = design.conditions
    rng = generator(*key, "chamber")
    shape = (units, len(design))
    jitter = settings.temperature_jitter * rng.normal(size=shape)
    drift = settings.temperature_jitter / 300.0 * rng.normal(size=shape)
    return Conditions(
        rate=_repeated(nominal.rate, units),
        specific_force=_repeated(nominal.specific_force, units),
        temperature_degc=(nominal.temperature_degc + jitter).ravel(),
        temperature_rate=(nominal.temperature_rate + drift).ravel(),
        time_on=_repeated(nominal.time_on, units),
        day=_repeated(nominal.day, units),
    )


def _repeated(values: Array, units: int) -> Array:
    return np.broadcast_to(values, (units, *values.shape)).reshape(-1, *values.shape[1:])


def readings(
    sensor: Sensor,
    conditions: Conditions,
    errors: Sequence[DrawnError],
    noise: Array | float,
) -> Array:
    """(B · n, 3) what the sensor reads: y = (1 + κ)(M u) + b + noise."""
    mine = [e for e in errors if e.sensor == sensor]
    u = sensed(sensor, conditions)
    v = u + _sum("misalignment", sensor, conditions, mine)
    leaned = replace(conditions, **{_DRIVE[sensor]: v})
    y = v + _sum("scale_factor", sensor, leaned, mine) + _sum("bias", sensor, conditions, mine)
    return np.asarray(y + noise)


def _sum(group: str, sensor: Sensor, conditions: Conditions, errors: Sequence[DrawnError]) -> Array:
    total = np.zeros((len(conditions.day), 3))
    for error in errors:
        effect = catalog.effects()[error.effect]
        if effect.group == group:
            values = error.records.reshape(len(total), -1)
            total += np.einsum("nct,nt->nc", effect.regressors(sensor, conditions), values)
    return total


def white_noise(
    sensor: Sensor, design: Design, units: int, settings: Settings, key: tuple[int, int]
) -> Array:
    """(B · n, 3) of a record's mean."""
    sigma = settings.white[sensor] / np.sqrt(design.duration)
    draw = generator(*key, "white", sensor).normal(size=(units, len(design), 3))
    return np.asarray((sigma[None, :, None] * draw).reshape(-1, 3))


# ---------------------------------------------------------------- calibrating


def calibrated(estimator: ChannelEstimator, conditions: Conditions, y: Array, units: int) -> Array:
    """(B, p) coefficients of one channel from its readings y (B · n,)."""
    model = replace(estimator.model, conditions=conditions)
    start = model.start()
    parts = evaluate(model, start)
    biases, leans = parts.B.shape[1], parts.L.shape[1]
    scales = estimator.count - biases - leans
    u, y = parts.v.reshape(units, -1), y.reshape(units, -1)
    B, L = (x.reshape(*u.shape, x.shape[1]) for x in (parts.B, parts.L))
    bend = _Bend(model, start)
    theta = first = (y - u) @ estimator.inverse.T
    with np.errstate(all="ignore"):  # a design that determines nothing may run away: see below
        for _ in range(_ROUNDS):
            b, k, m = theta[:, :biases], theta[:, biases : biases + scales], theta[:, biases + scales :]
            v = u + _times(L, m)
            step = (y - v - bend(v, k) - _times(B, b)) @ estimator.inverse.T
            theta = theta + step
        settled = np.all(np.abs(step) <= 0.1 * np.abs(first) + 1e-9, axis=1)
    return np.where(settled[:, None], theta, first)


def _times(matrix: Array, values: Array) -> Array:
    """(B, n, p), (B, p) -> (B, n)."""
    return np.asarray((matrix @ values[:, :, None])[:, :, 0])


class _Bend:
    """κ v = S(v) k; where every scale effect is proportional to its input, S(v) = S(1) v once and for all."""

    def __init__(self, model: ChannelModel, start: Array) -> None:
        self.model, self.start = model, start
        self.proportional = set(model.scale) <= {"scale_factor"}
        self.of_one = self._of(np.ones(len(model.conditions.day))) if self.proportional else None

    def __call__(self, v: Array, k: Array) -> Array:
        if k.shape[1] == 0:
            return np.zeros(v.shape)
        if self.of_one is not None:
            return v * _times(self.of_one.reshape(*v.shape, -1), k)
        return _times(self._of(v.ravel()).reshape(*v.shape, -1), k)

    def _of(self, v: Array) -> Array:
        """S (rows, k) with v in place of the channel's own input."""
        name = _DRIVE[self.model.sensor]
        driven = sensed(self.model.sensor, self.model.conditions).copy()
        driven[:, self.model.channel] = v
        changed = replace(self.model.conditions, **{name: driven})
        return evaluate(replace(self.model, conditions=changed), self.start).S
