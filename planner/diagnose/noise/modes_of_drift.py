"""Modes of what wanders within power-ons: columns of which its covariance is made.

L Lᵀ = z zᵀ ∘ ρ(|Δt| / τ) in every power-on,   L = V √Λ of its eigenvectors and eigenvalues
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.random_effects import Drift

MOST_ROWS = 1000  # of a power-on: a process has a mode for every record


def modes_of(drift: Drift, power_ons: Sequence[NDArray[np.int64]], least: float = 0.0) -> Array:
    """(n, k) L of a process in some power-ons, each its rows; one of more than MOST_ROWS has none.

    least: share of a power-on's variance, of which less is no mode
    """
    found = [np.empty((len(drift.z), 0))]
    for rows in power_ons:
        if len(rows) > MOST_ROWS:
            continue
        value, vector = np.linalg.eigh(drift.block(rows[None])[0])
        told = value > least * max(value.sum(), 0.0)
        modes = np.zeros((len(drift.z), int(told.sum())))
        modes[rows] = vector[:, told] * np.sqrt(value[told])
        found.append(modes)
    return np.column_stack(found)
