"""Whether what tells days apart is no more than the walk that the spec budgets for the time in store.

    z = C γ + w(D) + e,   cov w(D), w(D') = f² σ² (T − max(D, D')) / 60 days,   0 ≤ f ≤ 1

as in `as_likely`: σ the bias' storage of the spec, T the last day. A bias that walks at random has a largest
jump between two days and a slope over all: a step and an ageing of five sigma, which the noise of rows
and power-ons does not make. Of a unit that does not walk the other days and channels show that, and a step
larger than what the budget makes in those days is none of a walk's. On two days both are the same, and the
budget says which.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from planner.campaign.prior import walk_modes
from planner.diagnose.hypotheses.found import Found
from planner.diagnose.vetoes.as_likely import as_likely
from planner.diagnose.vetoes.own_noise import BETWEEN, of_means
from planner.nouns.array import Array
from planner.spec.budget import ErrorBudget


def as_walked(found: Found, b: int, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> bool:
    """Whether a believed block of one channel, that tells power-ons apart, is as likely a walk in store.

    starts: (g,) first row of every power-on; budgets: of the sensor, by error
    """
    block, bias = found.pool.blocks[b], budgets.get("bias")
    if block.reference or len(block.columns) != 1 or bias is None or bias.storage_sigma <= 0.0:
        return False
    (axis,) = block.columns
    w = found.pool.state[axis]
    if of_means(block.columns[axis], starts) <= BETWEEN:
        return False
    modes = _modes(w.channel.model.conditions.day, starts) * bias.storage_sigma
    state = found.pool.state
    return modes.shape[1] > 0 and as_likely(found, b, {a: (modes, s) for a, s in state.items()})


def _modes(day: Array, starts: NDArray[np.int64]) -> Array:
    """(n, k) modes of a walk over the days of the power-ons, of unit variance over STORAGE_DAYS."""
    return np.repeat(walk_modes(day[starts]), np.diff(np.append(starts, len(day))), axis=0)
