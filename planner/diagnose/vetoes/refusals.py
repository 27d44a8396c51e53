"""What the power-ons refuse of what a search believes, and what stands in the place of a refused name."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.found import Found, on
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE, MOST_OF_BOTH, STAYS
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.vetoes.as_budgeted import as_budgeted
from planner.diagnose.vetoes.curve_between_nodes import as_bent
from planner.diagnose.vetoes.own_noise import stands_in_own_noise
from planner.diagnose.vetoes.verdicts import (
    OF_A_TABLE,
    SCATTERS,
    Veto,
    per_power_on,
    predicted,
    repeats_in_one,
    told_by_branches,
    vetoed,
)
from planner.diagnose.vetoes.walk_in_store import as_walked
from planner.diagnose.vetoes.wander_in_run import as_wandered
from planner.spec.budget import ErrorBudget

NOISE = "what wanders on this channel within power-ons explains it as well"
DRAWN = (
    "what the spec lets scale factors and misalignments differ from power-on to power-on explains it as well"
)
WALKED = "the walk in store that the spec budgets explains it as well"
WANDERED = "what the spec lets wander within a power-on explains it as well"
BENT = "the curve over temperature that the spec lets a table miss between its nodes explains it as well"
AS_THE_SPEC_SAYS = (DRAWN, WALKED, WANDERED, BENT)
SURE = 5.0  # sigma, at which a variable is told although its effect is not


def refusals(found: Found, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> tuple[Veto, ...]:
    """What the power-ons themselves refuse goes, the weakest first: the others may stand without it.

    In the place of a name come bins over a variable that the power-ons do not refuse.
    """
    out = []
    for b in sorted(found.all, key=lambda i: found.share(i).delta):
        gone = b not in found.all  # with a name before it
        veto = None if gone else _refused(found, b, starts, budgets)
        if veto is not None:
            (found.library if b in found.library else found.unknown).remove(b)
            out.append(veto)
            if not found.pool.blocks[b].generic and veto.why not in (SCATTERS, NOISE, *AS_THE_SPEC_SAYS):
                _unnamed_in_place(found, b, starts, budgets)
    return tuple(out)


def _refused(
    found: Found, b: int, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]
) -> Veto | None:
    """Why a believed block is refused, by the power-ons, its channel's noise or what the spec lets vary."""
    veto = None if found.pool.blocks[b].reference else vetoed(found, b, starts)
    if veto is None and _is_noise(found, b):
        veto = Veto(b, NOISE)
    by_spec = ((DRAWN, as_budgeted), (WALKED, as_walked), (WANDERED, as_wandered), (BENT, as_bent))
    for why, explained in by_spec:
        if veto is None and explained(found, b, starts, budgets):
            veto = Veto(b, why)
    return veto


def _unnamed_in_place(
    found: Found, b: int, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]
) -> None:
    """Where the power-ons refuse a name, bins over a variable may stand: something is there all the same.

    They must predict unseen power-ons themselves, or be told by one alone whose records or branches repeat
    them. Where power-ons scatter it wanders, and no bins are asked. Of bins over several variables that
    explain nearly as much as the best the first that is not refused stands. A faint name that rests on one
    power-on is that one's few sigma, whatever they seem to go with: a drift became a step after power-on.
    """
    pool = found.pool
    here = found.without()
    same = on(pool, range(len(pool.blocks)), found.axes(b))
    scores = {g: score(here, [g]) for g in same if pool.blocks[g].generic}
    order = sorted((g for g in scores if scores[g].delta >= SURE**2), key=lambda g: -scores[g].criterion)
    if not order or scores[order[0]].criterion < DECISIVE or on(pool, found.unknown, found.axes(b)):
        return
    least, variables = MOST_OF_BOTH * scores[order[0]].delta, set[str]()
    for g in order:
        variable = pool.blocks[g].name
        if variable not in variables and scores[g].delta >= least and scores[g].criterion >= DECISIVE:
            variables.add(variable)
            if _stands_in_place(found, g, b, scores[g].delta, starts, budgets):
                break
    else:
        return
    for i in found.on(found.axes(b)):
        alone = score(found.without(i, g), [i]).delta
        if len(found.axes(i)) == 1 and found.share(i).delta < STAYS * alone:
            found.library.remove(i)  # what is left of it may as well be the other's


def _stands_in_place(
    found: Found,
    g: int,
    b: int,
    explained: float,
    starts: NDArray[np.int64],
    budgets: Mapping[str, ErrorBudget],
) -> bool:
    """Whether bins may stand where the power-ons refuse a name b; they are believed then."""
    found.unknown.append(g)
    found.p[g] = found.p[b]
    beside = found.without(g)
    foreseen = predicted(*per_power_on(beside, [g], starts)) > OF_A_TABLE * explained
    repeats = foreseen or told_by_branches(beside, g, starts) >= 0 or repeats_in_one(found, g, starts)
    if repeats and _refused(found, g, starts, budgets) is None:
        return True
    found.unknown.remove(g)
    return False


def _is_noise(found: Found, b: int) -> bool:
    """Whether a block of one channel is no more than that channel's own noise."""
    block = found.pool.blocks[b]
    return not block.reference and len(block.columns) == 1 and not stands_in_own_noise(found, b)
