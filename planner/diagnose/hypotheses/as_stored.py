"""Whether what differs between days is sure beside the walk that the spec lets a bias make over them.

    V' = V + σ² Σ_k φ_k φ_kᵀ,   φ_k (n,) the modes of a random walk over the days, σ its storage per 60 days

The noise of a search has a level of every power-on, each by itself. Of a walk that is 1.2e-4 g after ten days
sixty power-ons tell the course well, and any course is a trend or a step at five sigma; the calibration's fit
has the walk among its unknowns and tells 3 sigma. No row refuses a walk as large as the budget, so that what
goes with the days must be as sure beside it as a name among so many must be (`sure_by_the_fit`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.campaign.prior import walk_modes
from planner.diagnose.hypotheses.as_budgeted import whitened_again
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.found import ALPHA, Found
from planner.diagnose.hypotheses.orthogonal import explained
from planner.diagnose.hypotheses.whitened import SEEN, log_p
from planner.spec.budget import ErrorBudget

DAY = "day"


def as_stored(found: Found, b: int, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> bool:
    """Whether a believed bias of one channel over the days is no surer than chance beside the walk."""
    block, budget = found.pool.blocks[b], budgets.get("bias")
    if budget is None or budget.storage_sigma <= 0.0 or len(block.columns) != 1 or not _of_the_days(block):
        return False
    (axis,) = block.columns
    w = found.pool.state[axis]
    modes = walk_modes(w.channel.model.conditions.day[starts])
    if not modes.size:
        return False
    walk = np.repeat(modes, np.diff(np.append(starts, len(w.z))), axis=0)
    others = [found.pool.blocks[o].columns[axis] for o in found.others(b) if axis in found.axes(o)]
    C, known = w.noise.whiten(block.columns[axis]), [w.Q, *(w.noise.whiten(x) for x in others)]
    drawn = w.noise.whiten(budget.storage_sigma * walk)
    wider = whitened_again(drawn, np.column_stack([w.z, C, *known]))
    k = 1 + C.shape[1]
    delta, rank = explained(wider[:, k:], wider[:, 1:k], wider[:, 0], SEEN)
    s = found.share(b)
    if rank == 0 or s.m == 0:
        return True
    looks = len({x.key for x in found.pool.blocks})
    return bool(log_p(delta, rank, s.freedom, s.s2) > np.log(ALPHA / looks))


def _of_the_days(block: Block) -> bool:
    """Whether a block is a bias over the days: an effect's, or bins over them."""
    if block.generic or block.reference:
        return block.name == DAY
    effect = catalog.effects()[block.name]
    return effect.group == "bias" and DAY in effect.needs
