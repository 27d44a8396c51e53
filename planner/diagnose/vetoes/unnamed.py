"""A name that one generic alternative beats decisively is none: the variable is, and that is said.

A table of the library over one variable follows what goes with another: a face at rest is −1 g of the
channel's input. An equation that is right has fewer columns and leaves no more, so nothing beats it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.diagnose.hypotheses.agreement import rests_on
from planner.diagnose.hypotheses.candidates import LEAST_OF_A_TABLE, Block
from planner.diagnose.hypotheses.found import SINGLE, Found, Question, along, keys, on
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE, OWN_MISFIT, penalty, simplest
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.hypotheses.scores import delta, score
from planner.diagnose.references.references import hypothesis
from planner.diagnose.vetoes.verdicts import is_table

MISFIT_OF_A_NAME = 0.02  # share of Δ that readings with noise leave of an equation that is right
READ_WITH_NOISE = {"temperature", "temperature_rate"}  # days, times and inputs are what was set


def unname_where_unnamed_wins(found: Found, question: Question) -> None:
    """Put one generic alternative in the place of the names of a channel that it beats decisively.

    It must tell something itself, or it would go in its turn: the criterion takes the noise for known, and
    where six power-ons on an arm tell that by three degrees of freedom, four columns that beat a cubic of
    22 sigma were no surer than one in ten by themselves, and nothing was said.
    """
    for axis in found.pool.axes if told_apart(found.pool) else ():
        mine = found.on({axis})
        before = on(found.pool, found.unknown, {axis})
        here = found.without(*mine, *before)
        if not mine or any(_of_several(found.pool, here, b, axis) for b in mine):
            continue
        every = {g: score(here, [g]) for g in on(found.pool, question.generic, {axis})}
        scores = {g: s.criterion for g, s in every.items() if s.log_p < np.log(SINGLE)}
        if not scores:
            continue
        best = simplest(found.pool, scores)
        named = _criterion(here, mine) - (len(mine) - 1) * choice(found, question, axis)
        if before and not all(found.stands(b) for b in mine):
            named = max(named, _criterion(here, [*mine, *before]) - len(mine) * choice(found, question, axis))
        if scores[best] > named + _margin(found, mine, best, here):
            found.stands_for(best, mine, question)
            found.library = [b for b in found.library if b not in mine]
            found.unknown = [*(u for u in found.unknown if u not in before), best]


def _of_several(pool: Pool, here: Pool, b: int, axis: int) -> bool:
    """Whether a block is of more channels than one, as what is wrong with a bench is, and others see it.

    A lever arm along x is hardly more than squares of the rates on accelerometer x, where nothing turns about
    tilted axes. Another curve of that one's over the rate was called so, since no other channel contradicts.
    """
    block = pool.blocks[b]
    return len(block.columns) > 1 and (block.reference or not rests_on(here, b, {axis}))


def _criterion(here: Pool, blocks: Sequence[int]) -> float:
    """Of some blocks of one channel together, by the penalties that each has alone."""
    return delta(here, blocks) / score(here, blocks).s2 - sum(penalty(here, b) for b in blocks)


def _margin(found: Found, mine: Sequence[int], best: int, here: Pool) -> float:
    """By how much a generic alternative must beat a channel's names: decisively, and beyond their misfit.

    Two names give way to a variable of theirs that does as well: that is one claim instead of two. So does a
    name with more to it than its equation, to one column: what turns alone have steps on the day they begin.
    And a table of drifts to another course over the time that does as well: it claims none, only its values.
    """
    if len(mine) == 1 and _more_than_its_equation(found.pool.blocks[mine[0]]) and score(here, [best]).m == 1:
        return 0.0
    name, own = found.pool.blocks[best].name, {along(found.pool, b) for b in mine}
    if name in own - READ_WITH_NOISE and (len(mine) > 1 or is_table(found, mine[0])):
        return 0.0
    misfit = OWN_MISFIT if name in own & READ_WITH_NOISE else MISFIT_OF_A_NAME
    return max(DECISIVE, misfit * delta(here, mine) / score(here, mine).s2)


def _more_than_its_equation(block: Block) -> bool:
    """Whether a day was chosen for it among many, or turns have a level of their own in it."""
    return bool(block.place) or any(p.stepped for p in hypothesis(block.name).parameters)


def choice(found: Found, question: Question, axis: int) -> float:
    """What one more name on a channel costs by the criterion: it was chosen among so many, 2 log n."""
    return 2.0 * float(np.log(len(keys(found.pool, on(found.pool, question.library, {axis})))))


def told_apart(pool: Pool) -> bool:
    """Whether power-ons are enough to tell variables apart: in one long record bins of time follow all."""
    return all(len(w.noise.starts) >= LEAST_OF_A_TABLE for w in pool.state.values())
