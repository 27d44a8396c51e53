"""The course of the temperature within power-ons, from what a thermometer reads and how fast it says it goes.

A body behind its thermometer follows how the temperature moves from row to row. A unit that warms itself
moves by 0.04 K between two records, each read to 0.01 K: a third of that slope is noise of the readings, and
the lag that is made of it had half of its coefficient. The rates say the slopes ten times better.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.conditions import Conditions

MOVES_K = 0.3  # four sigma of the difference of two readings to 0.05 K: what differs by more has moved
RATES = (0.1, 0.3, 1.0, 3.0)  # noise of what rates say of one step, in that of a reading
SEEN = 6.0  # of twice the log of the likelihood, by which readings with noise must be likelier than none
LEAST = 8  # steps, below which nothing is said of noise
TINY = 1e-30  # K² or seconds, instead of nothing


def along_rates(conditions: Conditions, first: NDArray[np.bool_]) -> Conditions:
    """The conditions with the temperature T̂ for T; first: (n,) rows that begin a power-on.

        T̂ = argmin Σ (T̂_k − T_k)² + Σ (T̂_k+1 − T̂_k − h_k (r_k + r_k+1) / 2)² / (ρ h_k / h)²

    r = dT/dt, h_k seconds between two rows, h their mean; ρ by maximum likelihood of the differences

        d_k = T_k+1 − T_k − h_k (r_k + r_k+1) / 2,   cov d = σ² (D Dᵀ + ρ² diag(h_k / h)²)

    D the differences of neighbours. What went between two rows otherwise than its rates say, a chamber that
    moved on, stays as it was read; and so does all where no noise of readings is seen.
    """
    t, T, r = conditions.time_on, conditions.temperature_degc, conditions.temperature_rate
    if len(t) <= LEAST:
        return conditions
    step = np.diff(t)
    d = np.diff(T) - 0.5 * step * (r[1:] + r[:-1])
    even = ~first[1:] & (np.abs(d) <= MOVES_K)
    h = np.where(even, step * np.sum(even) / max(float(np.sum(step * even)), TINY), 1.0)
    d = np.where(even, d, 0.0)
    stiff = even / (_noise_of_rates(d, h, even) * h) ** 2
    return replace(conditions, temperature_degc=T + _drawn(stiff, d))


def _noise_of_rates(d: Array, h: Array, even: NDArray[np.bool_]) -> float:
    """ρ; infinite where readings without noise are as likely. d, h: 0 and 1 where no step is even."""
    from scipy.linalg import cholesky_banded, solve_banded

    n = int(np.sum(even))
    joined = np.append(even[1:] & even[:-1], False)[: len(d)]
    unlikely = [_unlikely(d / h, h, even)]
    for rho in RATES:
        lower = cholesky_banded(np.array([2.0 + (rho * h) ** 2, -1.0 * joined]), lower=True)
        unlikely.append(_unlikely(solve_banded((1, 0), lower, d), lower[0], even))
    best = int(np.argmin(unlikely))
    seen = n >= LEAST and unlikely[best] < unlikely[0] - SEEN
    return float(RATES[best - 1]) if seen else np.inf


def _unlikely(white: Array, root: Array, even: NDArray[np.bool_]) -> float:
    """−2 log of the likelihood of the even steps at its best size; root: that of the diagonal's factor."""
    mean_square = np.sum(white**2) / max(int(np.sum(even)), 1)
    return float(np.sum(even) * np.log(mean_square + TINY) + 2.0 * np.sum(np.log(root) * even))


def _drawn(stiff: Array, d: Array) -> Array:
    """(n,) x = T̂ − T: (1 + Dᵀ S D) x = −Dᵀ S d, S = diag(stiff)."""
    from scipy.linalg import solveh_banded

    pull = stiff * d
    bands = np.ones((2, len(d) + 1))
    bands[0] = np.append(0.0, -stiff)
    bands[1] += np.append(stiff, 0.0) + np.append(0.0, stiff)
    return np.asarray(solveh_banded(bands, np.append(pull, 0.0) - np.append(0.0, pull)))
