"""What a plan's records do to the estimates: every chance of the campaign through the least squares.

θ̂ = P (y − u) for all channels of both sensors, P the pseudo-inverse of the whitened records (calibrations).
The readings are Σ z θ over all budgeted errors, so a chance that adds s to a coefficient in record i adds
P z s to the estimates. Runs, drift, noise and references make one covariance of the estimates; constants,
curves and walks are met again in flight, so their columns are kept apart.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.nouns.array import Array
from planner.protocols import SENSORS, Sensor
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec
from planner.verify.calibrations import Estimator
from planner.verify.chance import Chance
from planner.verify.declared import INPUT
from planner.verify.draws import Unit
from planner.verify.records import Records
from planner.verify.references import Direction, directions, thermometers
from planner.verify.second_moments import Error


@dataclass(frozen=True)
class Estimates:
    """The estimates of all P coefficients, estimator by estimator: (sensor, place of its first, itself).

    noise: (P, P) covariance by runs, drift, white noise and references of the campaign
    constant: error -> (P, t) by one of its constants; curve: error -> (P, t, N) by its curve at each of the
    temperatures degc (N,); slope: the same by its slope on the bench of each thermometer that errs, with the
    thermometer's sigma, K; strays: error -> (N, P, P) covariance by its slopes of one K⁻¹ there, as the
    chamber strays from record to record
    walk: error -> (P, t, D) by the walk on the days (D,)
    """

    estimators: tuple[tuple[Sensor, int, Estimator], ...]
    noise: Array
    constant: Mapping[Error, Array]
    degc: Array
    curve: Mapping[Error, Array]
    slope: Mapping[Error, Sequence[tuple[float, Array]]]
    strays: Mapping[Error, Array]
    days: Array
    walk: Mapping[Error, Array]


def estimates(
    records: Records,
    unit: Unit,
    estimators: Mapping[Sensor, Sequence[Estimator]],
    spec: Spec,
    chance: Chance,
) -> Estimates:
    """The campaign of one unit, all channels at once."""
    every, count = [], 0
    for sensor, e in ((s, e) for s in SENSORS for e in estimators[s]):
        every.append((sensor, count, e))
        count += len(e.inverse)
    P = _weights(records, every, count)
    degc, at = np.unique(np.round(records.conditions.temperature_degc, 9), return_inverse=True)
    days, on = np.unique(records.on_day, return_inverse=True)
    noise = _white(P, records, chance) + _references(P, directions(records, spec))
    constant, curve, slope, strays, walk = {}, {}, {}, {}, {}
    for error, budget in unit.budgets.items():
        sensor, effect = error
        z = catalog.effects()[effect].regressors(sensor, records.conditions)
        each = np.einsum("pnc,nct->ptn", P[sensor], z)
        noise += _of_power_ons(each, budget, records)
        constant[error] = each.sum(axis=2)
        curve[error] = _summed(each, at, len(degc))
        slope[error] = [
            (sigma, _summed(each * rows, at, len(degc))) for sigma, rows in thermometers(records, spec)
        ]
        each_at = [each[:, :, at == k].reshape(len(each), -1) for k in range(len(degc))]
        strays[error] = np.array([chance.temperature_jitter**2 * one @ one.T for one in each_at])
        walk[error] = _summed(each, on, len(days))
    return Estimates(tuple(every), noise, constant, degc, curve, slope, strays, days, walk)


def _weights(
    records: Records, estimators: Sequence[tuple[Sensor, int, Estimator]], count: int
) -> dict[Sensor, Array]:
    """Sensor -> (P, n, 3): what each reading weighs in each coefficient."""
    found = {s: np.zeros((count, len(records), 3)) for s in SENSORS}
    for sensor, first, e in estimators:
        p, channels = len(e.inverse), list(e.model.channels)
        rows = e.inverse.reshape(p, len(records), len(channels))
        found[sensor][first : first + p, :, channels] = rows
    return found


def _summed(each: Array, where: NDArray[np.intp], count: int) -> Array:
    """(P, t, count) sums over the records that are at the same place."""
    return np.asarray(each @ (where[:, None] == np.arange(count)).astype(float))


def _white(P: Mapping[Sensor, Array], records: Records, chance: Chance) -> Array:
    total = np.zeros((len(P["gyro"]),) * 2)
    for sensor in SENSORS:
        rows = P[sensor] * (chance.white[sensor] / np.sqrt(records.duration))[:, None]
        total += rows.reshape(len(rows), -1) @ rows.reshape(len(rows), -1).T
    return total


def _references(P: Mapping[Sensor, Array], off: Sequence[Direction]) -> Array:
    """Levels, rates and mountings that err: one and the same for both sensors."""
    total = np.zeros((len(P["gyro"]),) * 2)
    for d in off:
        one = sum(np.einsum("pnc,nc->p", P[s], getattr(d, INPUT[s])) for s in SENSORS)
        total += d.sigma**2 * np.outer(one, one)
    return total


# ---------------------------------------------------------------- power-on by power-on


def _of_power_ons(each: Array, budget: ErrorBudget, records: Records) -> Array:
    """(P, P) by the draws of an error from power-on to power-on, and by its drift within them."""
    c, total = records.conditions, np.zeros((len(each),) * 2)
    length, tau = budget.temperature_correlation, budget.in_run_time
    if budget.has_run_to_run:
        s = budget.run_to_run_sigma(c.temperature_degc)

        def alike(rows: NDArray[np.int64]) -> Array:
            apart = np.subtract.outer(c.temperature_degc[rows], c.temperature_degc[rows])
            return np.ones(apart.shape) if length is None else np.exp(-0.5 * (apart / length) ** 2)

        total += _squared(each * s, records, alike)
    if budget.in_run_sigma > 0:
        total += budget.in_run_sigma**2 * _squared(
            each,
            records,
            lambda rows: np.exp(-np.abs(np.subtract.outer(c.time_on[rows], c.time_on[rows])) / tau),
        )
    return total


def _squared(each: Array, records: Records, kernel: Callable[[NDArray[np.int64]], Array]) -> Array:
    """(P, P) Σ over power-ons and terms of rows K rowsᵀ; each: (P, t, n)."""
    total = np.zeros((len(each),) * 2)
    for rows, K in _with_kernels(records, kernel):
        mine = each[:, :, rows]  # (P, t, runs, m)
        total += (mine @ K).reshape(len(each), -1) @ mine.reshape(len(each), -1).T
    return total


def _with_kernels(
    records: Records, kernel: Callable[[NDArray[np.int64]], Array]
) -> Iterator[tuple[NDArray[np.int64], Array]]:
    """(runs, m) rows of the power-ons that have one kernel (m, m) in common."""
    alike: dict[bytes, list[NDArray[np.int64]]] = {}
    for rows in records.runs:
        alike.setdefault(np.round(kernel(rows), 12).tobytes(), []).append(rows)
    for several in alike.values():
        yield np.array(several), kernel(several[0])
