"""Whether something beside a fault of the bench is one channel's own, and no part of the fault.

What the hypothesis of a fault misses goes through the same reference, so every channel that it drives misses
a part as well, of its own size: a table of which each level is off has no drift of one gyro. What one channel
lacks, while the others that see the fault as well lack nothing that goes with the same variable, is its own.
As long as it is more than products of the fault with the unit's own leans and scale factors may leave.
"""

from __future__ import annotations

import numpy as np

from planner.diagnose.hypotheses.agreement import explained_by_each
from planner.diagnose.hypotheses.found import SINGLE, Found, along, free, on
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.references.references import REFERENCES

AS_WELL = 0.1  # of what the channel sees of the fault, from which another one sees it as well
PRODUCTS = 1e-3  # of a fault: leans and scale factors through which a channel sees it are known to that
KNOWN = 0.1  # share of a fault that its hypothesis misses, from which channels may miss what they like


def of_one_channel_alone(found: Found, b: int, fault: int) -> bool:
    """Whether a block of one channel is that one's own, beside a believed fault of the bench."""
    pool = found.pool
    r = REFERENCES.get(pool.blocks[fault].name)
    if r is None or r.by_channel or r.misfit > KNOWN or len(pool.blocks[b].columns) > 1:
        return False
    (axis,) = pool.blocks[b].columns
    if score(found.without(b), [b]).delta < PRODUCTS**2 * found.share(fault).delta:
        return False
    seen = explained_by_each(found.without(fault), fault)
    others = {a for a in seen if a != axis and seen[a] >= AS_WELL * seen[axis]}
    here, block = found.without(), pool.blocks[b]
    names = {block.name} if block.generic else {block.name, along(pool, b)}
    every = free(pool, on(pool, range(len(pool.blocks)), others), found.all)
    like = [c for c in every if pool.blocks[c].name in names and len(pool.blocks[c].columns) == 1]
    return bool(others) and all(score(here, [c]).log_p > np.log(SINGLE) for c in like)
