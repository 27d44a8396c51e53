"""Whether what few power-ons tell is no more than what the spec lets a sensor wander while it is on.

    z = C γ + x(t) + e,   cov x(t), x(t') = f² (σ_b² + σ_s² u u') exp(−|t − t'| / τ) in every power-on

as in `as_likely`: σ and τ of the `in_run` of the bias and of the scale factor, u the input, f one for
the three channels, 0 to 1, and no other process in e. Of fewer than eight power-ons, each with a level of its
own, the rows of a channel hardly tell that it wanders (of more `own_noise` asks), and a process along which
each goes its own way is a drift, a warm-up or a curve over whatever else goes on in them, of seven sigma.

Of many rows stretches are asked (`in_stretches`), where the block keeps what it explains in them: no process
of the spec is like what changes from row to row.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.hypotheses.found import Found
from planner.diagnose.noise.channel_noise import LEAST_RUNS
from planner.diagnose.noise.modes_of_drift import MOST_ROWS, modes_of
from planner.diagnose.noise.whitened import Cleared, cleared
from planner.diagnose.vetoes.as_likely import as_likely, explained_in
from planner.diagnose.vetoes.in_stretches import Stretched, Stretches
from planner.nouns.array import Array
from planner.solvers.random_effects import Drift
from planner.spec.budget import ErrorBudget

LARGEST = 8000  # rows of a channel: larger tables are recordings, not dwells
STRETCHES = 500  # about so many of a channel: a process of 600 s is followed for three days
SLOW = 0.8  # of what a block explains in rows, that it must in stretches


def as_wandered(found: Found, b: int, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> bool:
    """Whether a believed block, told by few power-ons, is as likely what wanders in them.

    starts: (g,) first row of every power-on; budgets: of the sensor, by error
    """
    state = found.pool.state
    n = max(len(w.z) for w in state.values())
    wanders = any(budget.in_run_sigma > 0.0 for budget in budgets.values())
    if not wanders or len(starts) >= LEAST_RUNS or n > LARGEST:
        return False
    white = {axis: cleared(w.channel, w.noise.without_drifts(), ()) for axis, w in state.items()}
    channels: Mapping[int, Cleared | Stretched] = white
    if n <= MOST_ROWS:
        modes = {axis: _modes(w.channel, starts, budgets) for axis, w in state.items()}
    else:
        stretches = Stretches.of(starts, n, -(-n // STRETCHES))
        channels = {axis: Stretched.of(w, stretches) for axis, w in white.items()}
        if explained_in(found, b, channels) < SLOW * found.share(b).delta:
            return False
        modes = {axis: _modes_of_stretches(w.channel, stretches, budgets) for axis, w in state.items()}
    budgeted = {axis: (modes[axis], channels[axis]) for axis in state}
    return all(x.shape[1] > 0 for x in modes.values()) and as_likely(found, b, budgeted)


def _modes(c: Channel, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> Array:
    """(n, k) L of L Lᵀ, the covariance of what wanders: one sigma of every mode of bias and scale factor."""
    power_ons = np.split(np.arange(len(c.r)), starts[1:])
    inputs = {"bias": np.ones(len(c.r)), "scale_factor": c.u}
    drifts = _drifts(inputs, c.model.conditions.time_on, budgets)
    return np.column_stack([np.empty((len(c.r), 0)), *(modes_of(drift, power_ons) for drift in drifts)])


def _modes_of_stretches(c: Channel, stretches: Stretches, budgets: Mapping[str, ErrorBudget]) -> Array:
    """(n, k) the same of means of stretches; turns both ways leave nothing of a scale factor in them."""
    power_ons = np.split(np.arange(len(stretches.firsts)), stretches.starts[1:])
    time_on = stretches.means(c.model.conditions.time_on)
    drifts = _drifts({"bias": np.ones(len(time_on)), "scale_factor": stretches.means(c.u)}, time_on, budgets)
    modes = [np.empty((len(time_on), 0)), *(modes_of(drift, power_ons) for drift in drifts)]
    return stretches.over_rows(np.column_stack(modes))


def _drifts(
    inputs: Mapping[str, Array], time_on: Array, budgets: Mapping[str, ErrorBudget]
) -> Iterator[Drift]:
    """Of bias and scale factor, as the spec budgets them; inputs: (n,) what each is multiplied with."""
    for name, z in inputs.items():
        budget = budgets.get(name)
        if budget is not None and budget.in_run_sigma > 0.0:
            yield Drift(budget.in_run_sigma * z, time_on, budget.in_run_time)
