"""Whether what few power-ons tell is no more than what the spec lets a sensor wander while it is on.

    z = C γ + x(t) + e,   cov x(t), x(t') = f² (σ_b² + σ_s² u u') exp(−|t − t'| / τ) in every power-on

as in `as_likely`: σ and τ of the `in_run` of the bias and of the scale factor, u the input, f one for
the three channels, 0 to 1, and no other process in e. Of fewer than eight power-ons, each with a level of its
own, the rows of a channel hardly tell that it wanders (of more `own_noise` asks), and a process along which
each goes its own way is a drift, a warm-up or a curve over whatever else goes on in them, of seven sigma.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.hypotheses.found import Found
from planner.diagnose.noise.channel_noise import LEAST_RUNS
from planner.diagnose.noise.modes_of_drift import MOST_ROWS, modes_of
from planner.diagnose.noise.whitened import cleared
from planner.diagnose.vetoes.as_likely import as_likely
from planner.nouns.array import Array
from planner.solvers.random_effects import Drift
from planner.spec.budget import ErrorBudget


def as_wandered(found: Found, b: int, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> bool:
    """Whether a believed block, told by few power-ons, is as likely what wanders in them.

    starts: (g,) first row of every power-on; budgets: of the sensor, by error
    """
    state = found.pool.state
    if len(starts) >= LEAST_RUNS or any(len(w.z) > MOST_ROWS for w in state.values()):
        return False
    budgeted = {
        axis: (_modes(w.channel, starts, budgets), cleared(w.channel, w.noise.without_drifts(), ()))
        for axis, w in state.items()
    }
    return all(modes.shape[1] > 0 for modes, _ in budgeted.values()) and as_likely(found, b, budgeted)


def _modes(c: Channel, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> Array:
    """(n, k) L of L Lᵀ, the covariance of what wanders: one sigma of every mode of bias and scale factor."""
    power_ons = np.split(np.arange(len(c.r)), starts[1:])
    found = [np.empty((len(c.r), 0))]
    for name, z in (("bias", np.ones(len(c.r))), ("scale_factor", c.u)):
        budget = budgets.get(name)
        if budget is not None and budget.in_run_sigma > 0.0:
            drift = Drift(budget.in_run_sigma * z, c.model.conditions.time_on, budget.in_run_time)
            found.append(modes_of(drift, power_ons))
    return np.column_stack(found)
