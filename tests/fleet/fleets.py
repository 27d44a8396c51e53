"""Fleets drawn with NumPy alone: regions to hold them against, checks of units, histories of drift."""

from __future__ import annotations

from functools import cache

import numpy as np

from planner.fleet.allowed_region import AllowedRegion, allowed_region
from planner.fleet.check_residual import MeasuredResidual
from planner.nouns.allowances import Allowance
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensitivities import Constraint
from planner.pipelines.fleet import Basis, basis_of
from tests.specs import loaded, small

G = 9.80665
DEG = np.pi / 180


@cache
def small_basis() -> Basis:
    """Biases of both sensors, 10 m, worst case; published coefficients shared out over the axes."""
    return basis_of(loaded(small()), None, lambda message: None)


def region(rule: str, terms: int = 6, seed: int = 1, probability: float | None = None) -> AllowedRegion:
    """A requirement on three components and one on the first of them, felt by `terms` biases."""
    rng = np.random.default_rng(seed)
    names = ("gyro.bias", "accelerometer.bias")[: terms // 3]
    vectors = {name: rng.normal(size=(3, 3)) for name in names}
    first = {name: v[:, :1] for name, v in vectors.items()}
    limits = (10.0, 6.0)
    constraints = [
        Constraint(i, "position", "m", rule, limit, 60.0, v, probability)
        for i, (v, limit) in enumerate(zip((vectors, first), limits, strict=True))
    ]
    allowances = [Allowance(name, "1", 0.5, 0.1, 0.05, 0.05, 0.0, 0.3) for name in names]
    return allowed_region(constraints, allowances)


def measured(residual: np.ndarray, covariance: np.ndarray, name: str = "u") -> MeasuredResidual:
    """A residual at one temperature, all terms measured."""
    seen = np.ones(len(residual), dtype=bool)
    return MeasuredResidual(name, 20.0, 0.0, residual, covariance, seen, 4, 24)


def check_table(
    gyro: np.ndarray,
    acc: np.ndarray,
    rng: np.random.Generator,
    *,
    run_to_run: tuple[float, float] = (0.002 * DEG, 0.001 * G),
    in_run: tuple[float, float] = (0.001 * DEG, 0.0005 * G),
    noise: tuple[float, float] = (2e-4 * DEG, 1e-4 * G),
    power_ons: int = 6,
    temperatures: tuple[float, ...] = (-60.0, 0.0, 60.0),
    motions: int = 6,
) -> DwellTable:
    """Checks of n units with biases gyro, acc (n, 3), SI: faces in each power-on at each temperature."""
    faces = np.concatenate([np.eye(3), -np.eye(3)])[:motions] * G
    n, k = len(gyro), len(temperatures)
    shape = (n, k, power_ons, motions, 3)
    # in-run: as slow as a power-on lasts
    draws = [
        rng.normal(size=(n, k, power_ons, 1, 3)) * np.hypot(*s) for s in zip(run_to_run, in_run, strict=True)
    ]
    white = [rng.normal(size=shape) * s for s in noise]
    rate = gyro[:, None, None, None, :] + draws[0] + white[0]
    force = faces + acc[:, None, None, None, :] + draws[1] + white[1]
    rows = int(np.prod(shape[:-1]))
    index = np.indices(shape[:-1]).reshape(4, -1)
    zero = np.zeros(rows)
    return DwellTable(
        unit=np.array([f"u{i:04d}" for i in index[0]]),
        run=(index[0] * k + index[1]) * power_ons + index[2] + 1,
        day=zero,
        time_on=30.0 + 60.0 * index[3],
        duration=zero + 60.0,
        temperature_degc=np.array(temperatures)[index[1]],
        temperature_rate=zero,
        ref_rate=np.zeros((rows, 3)),
        ref_acc=np.broadcast_to(faces, shape).reshape(rows, 3).copy(),
        gyro=rate.reshape(rows, 3),
        acc=force.reshape(rows, 3),
        source="drawn",
    )


def drifting(
    units: int,
    weeks: int,
    later: int,
    rng: np.random.Generator,
    *,
    drift: float = 0.05,
    walk: float = 0.05,
    noise: float = 0.2,
) -> tuple[np.ndarray, np.ndarray]:
    """True values and measurements (units, weeks + later): a drift of each unit, a random walk, noise."""
    t = np.arange(weeks + later)
    steps = rng.normal(size=(units, weeks + later)) * walk
    true = rng.normal(size=(units, 1)) * drift * t + np.cumsum(steps, axis=1)
    return true, true + noise * rng.normal(size=true.shape)
