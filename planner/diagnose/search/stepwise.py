"""Which candidates to believe: forward by criterion, swaps, backward, then lack of fit by what has no name.

A library effect enters when its family-wise p is small enough (Found.enters), the one with the best criterion
first, and may be swapped for another as others enter. What is then left without a name is for `lack_of_fit`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from planner.diagnose.hypotheses.agreement import rests_on
from planner.diagnose.hypotheses.chance import Nulls
from planner.diagnose.hypotheses.found import (
    ALPHA_UNKNOWN,
    SINGLE,
    TIE,
    Found,
    Key,
    Question,
    best_of,
    free,
    keys,
    on,
    significant,
)
from planner.diagnose.hypotheses.lack_of_fit import (
    DECISIVE,
    SHARED_MISFIT,
    bench_misfit,
    cut_chains,
    explained,
    lack_of_fit,
    of_the_bench,
    pairs_for_tables,
    stands_beside,
)
from planner.diagnose.hypotheses.pool import Pool, given
from planner.diagnose.hypotheses.scores import chance_of, score
from planner.diagnose.references.references import REFERENCES, hypothesis
from planner.diagnose.vetoes.forms import only_forms_that_hold
from planner.diagnose.vetoes.plainer import plainer
from planner.diagnose.vetoes.unnamed import unname_where_unnamed_wins

MOST = 8  # effects a sensor; a unit that lacks more has another problem
ROUNDS = 6  # of search and lack of fit


def search(pool: Pool, question: Question) -> Found:
    """What the pool's data say is missing."""
    found = Found(pool, [], [])
    for _ in range(ROUNDS):
        _forward(found, question)
        cut_chains(found, question)
        lacking = lack_of_fit(found, question)
        if not lacking:
            break
        explained(found, lacking, question)
    _swap_alike(found, question)
    pairs_for_tables(found, question)
    unname_where_unnamed_wins(found, question)
    plainer(found, question.library)
    only_forms_that_hold(found, question)
    _needless(found, question)
    _judge(found, question)
    return found


# ---------------------------------------------------------------- forward


def _forward(found: Found, question: Question) -> None:
    seen = {_state(found)}
    while len(found.library) < MOST:
        here = found.without()
        null = found.chance(question)
        scores = {b: score(here, [b]) for b in free(found.pool, question.library, found.all)}
        good = {b: s for b, s in scores.items() if found.enters(b, s, null)}
        good = {b: s for b, s in good.items() if stands_beside(found, b, s)}
        if not good:
            return
        criteria = found.criteria(question, good)
        found.library.append(best_of(found.pool, criteria))
        found.refine(question)
        _swap(found, question, null)
        found.refine(question)
        found.drop_needless(null)
        if _state(found) in seen:
            return
        seen.add(_state(found))


def _state(found: Found) -> frozenset[Key]:
    """What is believed, whatever the nonlinear parameters: a search that returns to it goes in circles."""
    return frozenset(keys(found.pool, found.library))


def _swap(found: Found, question: Question, null: Nulls) -> None:
    """Exchange each believed effect for the best in its place, until nothing changes.

    That something is there is as sure as it was: the name that explains it best stands for the one that was
    found, though alone among so many it might not have been.
    """
    for _ in range(3):
        changed = False
        for b in list(found.library):
            if found.stands(b):
                continue
            here = given(found.pool, found.others(b))
            candidates = free(found.pool, question.library, found.others(b))
            scores = {c: score(here, [c]) for c in [*candidates, b]}
            # few columns of nothing may be as good a choice as many of which one tells: they are no claim
            claims = {
                c: s for c, s in scores.items() if c == b or (s.log_p < np.log(SINGLE) and found.may_be(c, b))
            }
            rivals = found.criteria(question, claims, b)
            best = best_of(found.pool, rivals)
            every = {c: s.criterion for c, s in scores.items()}
            apart, together = _channel_by_channel(found, b, every, here)
            if together > rivals[best] + TIE + _coincidence(found, b, apart, here):
                instead = apart
            elif rivals[best] > rivals[b] + TIE:
                instead = [best]
                key = found.pool.blocks[b].key
                sure = min(chance_of(found.pool, b, scores[b], null), found.stood_for.get(key, 1.0))
                found.stood_for[found.pool.blocks[best].key] = sure
            else:
                continue
            place = found.library.index(b)
            found.library[place : place + 1], changed = instead, True
        if not changed:
            return


def _swap_alike(found: Found, question: Question) -> None:
    """Exchange a name of several channels for one that explains them decisively better, on all at once.

    One by one each is held by the others, of which it is likely to be one (`Found.alike`): where squares of
    rates came first, beside as much else that was not believed yet, no asymmetry took their place any more.
    """
    names = Counter(found.pool.blocks[b].name for b in found.library if _swaps_alike(found, b))
    several = [name for name, times in names.items() if times > 1]
    better = [x for name in several if (x := _better_on_all(found, name, question))[0] > DECISIVE]
    if not better:
        return
    null = found.chance(question)
    for b, c in max(better, key=lambda x: x[0])[1].items():
        key = found.pool.blocks[b].key
        sure = min(chance_of(found.pool, b, found.share(b), null), found.stood_for.get(key, 1.0))
        found.stood_for[found.pool.blocks[c].key] = sure
        found.library[found.library.index(b)] = c


def _better_on_all(found: Found, name: str, question: Question) -> tuple[float, dict[int, int]]:
    """By how much another name explains all channels of one better; block -> what comes in its place."""
    mine = {min(found.axes(b)): b for b in found.library if found.pool.blocks[b].name == name}
    here = given(found.pool, found.others(*mine.values()))
    every = free(found.pool, on(found.pool, question.library, set(mine)), found.others(*mine.values()))
    each: dict[str, dict[int, int]] = {}
    for c in (c for c in every if _swaps_alike(found, c) and score(here, [c]).log_p < np.log(SINGLE)):
        each.setdefault(found.pool.blocks[c].name, {})[min(found.axes(c))] = c

    def total(blocks: Iterable[int]) -> float:
        """Channels have no noise in common, so that criteria add up."""
        return sum(score(here, [c]).among_names + found.beforehand(c, ()) for c in blocks)

    totals = {other: total(blocks.values()) for other, blocks in each.items() if len(blocks) == len(mine)}
    best = max(totals, key=lambda other: totals[other], default=name)
    instead = {b: each[best][axis] for axis, b in mine.items()} if best != name else {}
    return (totals[best] - total(mine.values()) if instead else 0.0), instead


def _swaps_alike(found: Found, b: int) -> bool:
    """Whether a block is a sensor's own, of one channel and of one shape."""
    block = found.pool.blocks[b]
    alone = len(block.columns) == 1 and not block.reference and not block.nonlinear
    return alone and not found.stands(b)


def _channel_by_channel(
    found: Found, block: int, criteria: Mapping[int, float], here: Pool
) -> tuple[list[int], float]:
    """The blocks of the one effect that explains most on the channels of a block of several, their criterion.

    One channel of it explains less than what all of them have in common, whichever of the two is there. Both
    are judged by one variance: of a hundred rows each channel tells its own to a seventh, and by the mean of
    three what is common was behind by a hundredth of Δ, more at forty sigma than its columns cost.
    """
    axes, s2 = found.axes(block), score(here, [block]).s2
    effects: dict[str, dict[int, int]] = {}
    for c in sorted(criteria, key=lambda c: criteria[c]):
        own = found.axes(c)
        if len(own) == 1 and own <= axes and criteria[c] > 0.0:
            effects.setdefault(found.pool.blocks[c].name, {})[min(own)] = c  # the last one is the best
    several = [[*channels.values()] for channels in effects.values() if len(channels) > 1]
    beside = found.others(block)

    def together(blocks: Sequence[int]) -> float:
        """Channels have no noise in common, so that criteria add up."""
        each = [(c, score(here, [c])) for c in blocks]
        return sum(
            s.among_names + s.delta * (1.0 / s2 - 1.0 / s.s2) + found.beforehand(c, beside) for c, s in each
        )

    return max(((b, together(b)) for b in several), key=lambda one: one[1], default=([], -np.inf))


def _coincidence(found: Found, block: int, apart: Sequence[int], here: Pool) -> float:
    """What the criterion owes what is wrong with a bench and several channels say alike, before one of each.

    Coefficients of their own could each have been anything up to their size, t sigma: that all but one agree
    within one is a coincidence of 1 / t each, 2 log t. And the geometry of the bench is known only so well:
    at a thousand sigma its linear columns miss a part, which coefficients of their own take up. Where each
    of the block's own is of one channel, none agrees with another.
    """
    if not (of_the_bench(found, block) and len(found.axes(block)) > 1):
        return 0.0
    alike = float(sum(np.log(max(score(here, [c]).delta, 1.0)) for c in apart[1:]))
    name = found.pool.blocks[block].name
    if name in REFERENCES and REFERENCES[name].by_channel:
        return 0.0
    # an arm's own equation is known better: squares of loads of each gyro are no bending
    known = REFERENCES[name].unlike if name in REFERENCES else hypothesis(name).misfit
    return max(alike, min(SHARED_MISFIT, known) * score(here, [block]).delta)


# ---------------------------------------------------------------- the last word


def _needless(found: Found, question: Question) -> None:
    """An unknown that a library effect, found later, explains away is none; nor an effect beside others."""
    for b in list(found.unknown):
        s = score(found.without(b), [b])
        sure = found.may_stay(b, s) or significant(found.pool, b, s, found.chance(question, b), ALPHA_UNKNOWN)
        if not sure:
            found.unknown.remove(b)
    found.drop_needless(found.chance(question))
    for b in list(found.library):
        if bench_misfit(found, b, found.share(b).delta) or _of_an_unknown(found, b):
            found.library.remove(b)
    found.drop_needless(found.chance(question))


def _of_an_unknown(found: Found, b: int) -> bool:
    """Whether a reference is seen only on channels that lack something without a name: then that is all."""
    lacking = {a for u in found.unknown for a in found.axes(u)}
    return found.pool.blocks[b].reference and bool(lacking) and rests_on(found.without(b), b, lacking)


def _judge(found: Found, question: Question) -> None:
    """Family-wise p of everything believed, each beside the others, among all that was not believed."""
    null = found.chance(question)
    for b in found.all:
        own = chance_of(found.pool, b, found.share(b), null)
        found.p[b] = max(min(own, found.stood_for.get(found.pool.blocks[b].key, 1.0)), question.least_p)
