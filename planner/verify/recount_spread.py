"""The spread of one repeat counted again: what its records add, by least squares on unit errors.

s² = s_run² + Σ of squares of what a standard draw of every other error (one of this power-on, one of its own
estimate), of the drift between the records and of their noise does to the estimate of one repeat. The
estimate is solved for, column by column of the square root of the covariance; the planner's own matrices are
not used. Nothing is added under the normal quantile.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import SENSORS, Sensor
from planner.spec.budget import ErrorBudget
from planner.spec.model import Given, Spec
from planner.spec.motions import motions_of
from planner.verify.records import records_of

SEEN = 1e-10  # share of the largest singular value, below which a combination of columns is not seen
TOUCHED = 1e-6  # share of a column in such a combination
MOTION = frozenset(("rate", "specific_force"))  # all that the records of one repeat differ in


@dataclass(frozen=True)
class _Column:
    """One coefficient on one channel: its output (m,), the sigmas of its error, and its drift's time."""

    error: str
    served: bool
    output: Array
    run: float
    drift: float
    time: float


def spreads_of_records(spec: Spec) -> dict[tuple[str, str], float]:
    """(error, test) -> sigma, SI, that the records of one repeat of the test add."""
    if spec.plan.quantile == "normal":
        return {}
    found: dict[tuple[str, str], float] = {}
    for name, test in spec.tests.items():
        if test.calibrates and (seen := _conditions(spec, name)) is not None:
            found |= {(error, name): sigma for error, sigma in _of_test(spec, name, seen).items()}
    return found


def _conditions(spec: Spec, name: str) -> Conditions | None:
    """The records of one repeat; None where the bench's motions are unknown."""
    test = spec.tests[name]
    if any(motion is None for motion in motions_of(test.bench, spec.benches[test.bench], test)):
        return None
    return records_of({"steps": [*one_repeat(spec, name)]}, spec).conditions


def one_repeat(spec: Spec, name: str, clock: float = 0.0) -> Iterator[Mapping[str, Any]]:
    """One power-on of a test at the middle of the range from `clock` on, as steps of a plan."""
    test, (low, high) = spec.tests[name], spec.plan.temperatures.range
    bench = spec.benches[test.bench]
    step = {"bench": test.bench, "test": name, "temperature_degc": (low + high) / 2.0, "motion": None}
    yield {**step, "id": f"{name}/on", "action": "power_on", "start_s": clock, "end_s": clock}
    clock += test.power_on
    speed, lead = (0.0, 0.0) if test.ramp is None else (test.ramp.ramp * 60.0, test.ramp.lead)
    for k, motion in enumerate(motions_of(test.bench, bench, test)):
        begin = clock + bench.move + lead
        clock = begin + test.record
        named = {"id": f"{name}/m{k + 1}", "action": "record", "start_s": begin, "end_s": clock}
        moving = {"temperature_rate_degc_min": -speed if k % 2 else speed}
        yield {**step, **named, **moving, "motion": motion}
        clock += lead + test.gap
    yield {**step, "id": f"{name}/off", "action": "power_off", "start_s": clock, "end_s": clock}


def _of_test(spec: Spec, name: str, seen: Conditions) -> dict[str, float]:
    own: dict[str, list[float]] = {}
    for sensor in SENSORS:
        for channel in range(3):
            columns = _columns(spec, name, seen, sensor, channel)
            for column, sigma in _added(columns, seen, spec.tests[name].record, spec.unit.white(sensor)):
                own.setdefault(column.error, []).append(sigma)
    given = isinstance(spec.sensitivities, Given)  # one axis stands for all: the best one
    return {error: (min if given else max)(sigmas) for error, sigmas in own.items()}


def _columns(spec: Spec, name: str, seen: Conditions, sensor: Sensor, channel: int) -> list[_Column]:
    found = []
    budgets: Mapping[str, ErrorBudget] = getattr(spec.unit, sensor)
    for effect, budget in budgets.items():
        if not catalog.effects()[effect].needs <= MOTION:
            continue  # at one temperature and within the hour it cannot be told from a constant
        error = f"{sensor}.{effect}"
        served = error in spec.tests[name].calibrates and effect in spec.effects
        run = budget.run_to_run_largest
        outputs = catalog.effects()[effect].regressors(sensor, seen)[:, channel]
        found += [
            _Column(error, served, output, run, budget.in_run_sigma, budget.in_run_time)
            for output in outputs.T
            if output.any()
        ]
    return found


def _added(
    columns: list[_Column], seen: Conditions, record: float, white: float
) -> list[tuple[_Column, float]]:
    served = [c for c in columns if c.served]
    if not served:
        return []
    blocks = [c.run * c.output[:, None] for c in columns if not c.served and c.run > 0] * 2
    blocks += [c.drift * c.output[:, None] * _root(seen.time_on, c.time) for c in columns if c.drift > 0]
    m = len(seen.time_on)
    blocks.append(white / np.sqrt(record) * np.eye(m))
    unit_errors = np.concatenate(blocks, axis=1)
    weights = _weighed(served, columns, white / np.sqrt(record), m)
    observable = np.asarray(np.isfinite(weights).all(axis=1))
    sigma = np.linalg.norm(np.where(observable[:, None], weights, 0.0) @ unit_errors, axis=1)
    return list(zip(served, np.where(observable, sigma, np.inf).tolist(), strict=True))


def _root(time_on: Array, tau: float) -> Array:
    """(m, m) square root of exp(−|Δt|/τ)."""
    values, vectors = np.linalg.eigh(np.exp(-np.abs(np.subtract.outer(time_on, time_on)) / tau))
    return np.asarray(vectors * np.sqrt(np.clip(values, 0.0, None)))


def _weighed(served: list[_Column], columns: list[_Column], noise: float, m: int) -> Array:
    """(p, m) the estimator: least squares on records made white, drift taken as their own each time.

    Infinite for a coefficient that takes part in a combination which the records do not see.
    """
    U = np.diag(sum((c.drift * c.output) ** 2 for c in columns) + np.full(m, noise**2))
    for c in columns:
        if not c.served:
            U = U + 2.0 * c.run**2 * np.outer(c.output, c.output)
    largest = max(c.run**2 * float(np.mean(c.output**2)) for c in columns)
    floor = 1e-10 * largest if largest > 0 or U.any() else 1.0  # where nothing scatters, any weights do
    values, vectors = np.linalg.eigh(U + floor * np.eye(m))
    white = (vectors / np.sqrt(values)) @ vectors.T
    X = white @ np.array([c.output for c in served]).T
    size = np.linalg.norm(X, axis=0)
    u, s, vt = np.linalg.svd(X / size)
    r = int(np.sum(s > SEEN * s[0]))
    inverse = (vt[:r].T / s[:r]) @ u[:, :r].T
    hidden = np.linalg.norm(vt[r:], axis=0) > TOUCHED
    return np.asarray(np.where(hidden[:, None], np.inf, inverse / size[:, None] @ white))
