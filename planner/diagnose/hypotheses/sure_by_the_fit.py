"""Whether the calibration's fit is as sure of what was found as a search among many names must be.

The search weighs its candidates by noise of which it has only what the records show beforehand; the fit of
all that is declared and found knows of everything that the spec lets power-ons draw anew, and finds how much
there is of it. Ten power-ons at a temperature whose misalignments differ by 0.0005 deg are a misalignment
over temperature of seven sigma to the one and of 2.4 to the other. An interval of 95 % that leaves zero out
is then no evidence: of a hundred effects that were asked five have one. So of all its coefficients together

    looks · P(F > γᵀ Φ⁺ γ / r) ≤ ALPHA,   F of r and the least known coefficient's degrees (Wald)

is asked, looks as many as the effects and variables that the search had to choose from (Bonferroni).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner import catalog
from planner.diagnose.declared_and_found import ChannelEstimates
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.hypotheses.whitened import log_p

KNOWN = 1e6  # degrees of freedom, as of variances that are the spec's: F is then χ²


def fewest(block: Block) -> bool:
    """Whether a block has fewer coefficients than its effect has on the channel."""
    every = catalog.effects()[block.name].terms(block.sensor)
    return len(block.terms) < sum(bool(set(t.channels) & set(block.channels)) for t in every)


def chance_by_the_fit(pool: Pool, last: Mapping[int, ChannelEstimates], b: int) -> float:
    """Family-wise p of a block's coefficients in the fit, of its surest channel; 0 where that says nothing.

    It says nothing of a size that goes with a time constant, of tables over temperature, and of the fewest
    coefficients that tell an effect (`told_together`): in the fit the others hide them.
    """
    block = pool.blocks[b]
    if fewest(block):
        return 0.0
    told = [last[a].together.get(block.name) for a in block.channels if a in last]
    chances = [float(log_p(t.square, t.rank, min(t.freedom, KNOWN), 1.0)) for t in told if t is not None]
    if not chances:
        return 0.0
    looks = len({x.key for x in pool.blocks})
    return float(min(1.0, looks * np.exp(min(chances))))
