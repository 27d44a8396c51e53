"""Whether the calibration's fit is as sure of what was found as a search among many names must be.

The search weighs its candidates by noise of which it has only what the records show beforehand; the fit of
all that is declared and found knows of everything that the spec lets power-ons draw anew, and finds how much
there is of it. Ten power-ons at a temperature whose misalignments differ by 0.0005 deg are a misalignment
over temperature of seven sigma to the one and of 2.4 to the other. An interval of 95 % that leaves zero out
is then no evidence: of a hundred effects that were asked five have one. So of all its coefficients together

    looks · P(F > γᵀ Φ⁺ γ / r) ≤ ALPHA,   F of r and the least known coefficient's degrees (Wald)

is asked, looks as many as the effects and variables that the search had to choose from (Bonferroni).

Each of k coefficients is asked alone as well, by its own freedom: 2 min(p of all, k min p of each)
(Bonferroni), since all of them are nothing only if each is. Of six products of forces one was 9.8 sigma with
26 degrees of freedom and another known with six, of a lever arm one was 30 sigma with 18 and another known
with two: together they were no surer than chance.

Where fewer than eight degrees of freedom tell a coefficient, all of them are asked by the spec's budgets too,
three times as wide as they are, again the better of two.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner import catalog
from planner.diagnose.findings.declared_and_found import ChannelEstimates, Together
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.noise.whitened import log_p

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
    chances = [_log_p(t) for t in told if t is not None]
    if not chances:
        return 0.0
    looks = len({x.key for x in pool.blocks})
    return float(min(1.0, looks * np.exp(min(chances))))


def _log_p(told: Together) -> float:
    """log p that an effect's coefficients are all nothing, by what the fit knows or by the spec's budgets."""
    fitted = _by_the_fit(told)
    if not told.budgeted:
        return fitted
    return float(min(np.log(2.0) + min(fitted, float(log_p(told.budgeted, told.rank, KNOWN, 1.0))), 0.0))


def _by_the_fit(told: Together) -> float:
    """The same by all of them together or by the surest."""
    whole = float(log_p(told.square, told.rank, min(told.freedom, KNOWN), 1.0))
    k = len(told.each)
    if k < 2:
        return whole
    one = min(float(log_p(square, 1, min(freedom, KNOWN), 1.0)) for square, freedom in told.each)
    return float(min(np.log(2.0) + min(whole, np.log(k) + one), 0.0))
