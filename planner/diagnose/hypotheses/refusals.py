"""What the power-ons refuse of what a search believes, and what stands in the place of a refused name."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.as_budgeted import as_budgeted
from planner.diagnose.hypotheses.found import Found, on
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE, STAYS
from planner.diagnose.hypotheses.own_noise import stands_in_own_noise
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.hypotheses.verdicts import (
    OF_A_TABLE,
    SCATTERS,
    Veto,
    per_power_on,
    predicted,
    told_in_one,
    vetoed,
)
from planner.spec.budget import ErrorBudget

NOISE = "what wanders on this channel within power-ons explains it as well"
DRAWN = (
    "what the spec lets scale factors and misalignments differ from power-on to power-on explains it as well"
)


def refusals(found: Found, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> tuple[Veto, ...]:
    """What the power-ons themselves refuse goes, the weakest first: the others may stand without it.

    In the place of a name come bins over a variable that the power-ons do not refuse.
    """
    out = []
    for b in sorted(found.all, key=lambda i: found.share(i).delta):
        gone = b not in found.all  # with a name before it
        veto = None if gone or found.pool.blocks[b].reference else vetoed(found, b, starts)
        if veto is None and not gone and _is_noise(found, b):
            veto = Veto(b, NOISE)
        if veto is None and not gone and as_budgeted(found, b, starts, budgets):
            veto = Veto(b, DRAWN)
        if veto is not None:
            (found.library if b in found.library else found.unknown).remove(b)
            out.append(veto)
            if not found.pool.blocks[b].generic and veto.why not in (SCATTERS, NOISE, DRAWN):
                _unnamed_in_place(found, b, starts)
    return tuple(out)


def _unnamed_in_place(found: Found, b: int, starts: NDArray[np.int64]) -> None:
    """Where the power-ons refuse a name, bins over a variable may stand: something is there all the same.

    They must predict unseen power-ons themselves, unless one alone has what they go with. Where those
    scatter it wanders, and no bins are asked.
    """
    pool = found.pool
    here = found.without()
    same = on(pool, range(len(pool.blocks)), found.axes(b))
    scores = {g: score(here, [g]) for g in same if pool.blocks[g].generic}
    best = max(scores, key=lambda g: scores[g].criterion, default=None)
    if best is None or scores[best].criterion < DECISIVE or on(pool, found.unknown, found.axes(b)):
        return
    found.unknown.append(best)
    found.p[best] = found.p[b]
    beside = found.without(best)
    foreseen = predicted(*per_power_on(beside, [best], starts)) > OF_A_TABLE * scores[best].delta
    refused = vetoed(found, best, starts) is not None or _is_noise(found, best)
    if refused or not (foreseen or told_in_one(beside, best, starts) >= 0):
        found.unknown.remove(best)
        return
    for i in found.on(found.axes(b)):
        alone = score(found.without(i, best), [i]).delta
        if len(found.axes(i)) == 1 and found.share(i).delta < STAYS * alone:
            found.library.remove(i)  # what is left of it may as well be the other's


def _is_noise(found: Found, b: int) -> bool:
    """Whether a block of one channel is no more than that channel's own noise."""
    block = found.pool.blocks[b]
    return not block.reference and len(block.columns) == 1 and not stands_in_own_noise(found, b)
