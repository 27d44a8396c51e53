"""How well a fit does on runs that it has not seen: folds of whole runs, no condition lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.campaign.estimate import Estimate
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.calibration import Residual
from planner.solvers.least_squares import factors
from planner.solvers.random_effects import covariance
from planner.temperature_table import temperature_nodes
from planner.units import STANDARD_GRAVITY_MPS2

FOLDS = 5


def residual_of(fit: Estimate, y: Array) -> Residual:
    """Residual RMS of one channel before and after, on held-out runs where there are repeats to hold out.

    A fold leaves out whole power-ons, and only such as have a repeat (same temperature, same motion) in the
    fold's other runs. The fold's fit is one step of Gauss-Newton with the variances of the whole fit.
    """
    starts = fit.noise.effects.starts
    fold = _folds(fit, starts)
    raw = y - fit.model.u
    own = rms(fit.residual)
    channel = AXES[fit.model.channel]
    if fold.max(initial=-1) < 1:
        how = "no run has a repeat to be held out: these figures are of the rows that were fitted"
        return Residual(channel, rms(raw), own, own, False, len(y), len(starts), how)
    rows = np.repeat(fold, np.diff(np.append(starts, len(y))))
    left = _predicted_from_others(fit, y, rows)
    seen = rows >= 0
    alone = int((fold < 0).sum())
    how = f"{fold.max() + 1} folds of whole runs; {alone} runs without a repeat stay in every fit"
    return Residual(
        channel, rms(raw[seen]), rms(left[seen]), own, True, int(seen.sum()), int((fold >= 0).sum()), how
    )


def _predicted_from_others(fit: Estimate, y: Array, rows: NDArray[np.int64]) -> Array:
    """(n,) residuals, each by the other folds; V is block by power-on, so rows are whitened once for all."""
    target = fit.residual + fit.J @ fit.theta
    white = covariance(fit.noise.effects, fit.variances.theta).whiten(np.column_stack([fit.J, target]))
    left = np.zeros(len(y))
    for k in range(rows.max() + 1):
        out = rows == k
        found = factors(white[~out, :-1])
        beta = found.solve(white[~out, -1])
        left[out] = target[out] - fit.J[out] @ beta
    return left


def _folds(fit: Estimate, starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """(g,) fold of every run; −1 for a run whose condition has no repeat."""
    _, key, count = np.unique(
        _conditions_of_runs(fit, starts), axis=0, return_inverse=True, return_counts=True
    )
    folds = min(FOLDS, int(count.max(initial=0)))
    order = np.argsort(key, kind="stable")
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    seen = np.empty(len(key), dtype=np.int64)
    seen[order] = np.arange(len(key)) - first[key[order]]  # how many like it came before
    return np.where(count[key] > 1, seen % max(folds, 1), -1)


def _conditions_of_runs(fit: Estimate, starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """(g, 4) what was done in every run: temperature, its rate, greatest rate and load, rounded."""
    c = fit.model.conditions
    e = fit.noise.effects
    size = e.sums(np.ones(len(c.day)))
    mean = e.sums(c.temperature_degc) / size
    columns = np.column_stack(
        [
            np.argmin(np.abs(mean[:, None] - temperature_nodes(c.temperature_degc)), axis=1),
            np.round(e.sums(c.temperature_rate) / size * 60.0),
            np.round(np.log2(1.0 + 20.0 * np.maximum.reduceat(np.abs(c.rate).max(axis=1), starts))),
            np.round(
                np.maximum.reduceat(np.abs(c.specific_force).max(axis=1), starts) / STANDARD_GRAVITY_MPS2
            ),
        ]
    )
    return columns.astype(np.int64)


def rms(x: Array) -> float:
    """Root mean square of (n,); nan of nothing."""
    return float(np.sqrt(np.mean(x * x))) if len(x) else float("nan")
