"""What is left when no library effect is significant alone, told by alternatives that have no name.

When a generic alternative is still significant the library was wrong about that channel: either another of
its effects stands for it, or two of them together are right, or something is missing that it does not have;
then the generic enters, and a library effect stays only if it explains most of its share beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from planner.learn.diagnosis.found import Found, Question, free, keys, null_beside, on, significant
from planner.learn.diagnosis.pool import Pool, delta, given, null_of, score

SINGLE = 1e-3  # p of one test at which an effect may stand for a generic alternative that is significant
STAYS = 0.5  # share of its Δ that a library effect must keep beside an unknown
# share of the unknown's Δ that it must have: bins follow no curve exactly, and their rest fits anything
LEAST = 0.3
MISFIT = 0.03  # of the Δ of a bench's effect: its geometry is known roughly, less than that names no other


def lack_of_fit(found: Found, question: Question) -> list[int]:
    """The generic alternatives that are still significant, the strongest first."""
    here = given(found.pool, found.all)
    generic = free(found.pool, question.generic, found.unknown)
    null = null_of(here, [*free(found.pool, question.library, found.all), *generic], question.signs)
    scores = {g: score(here, [g]) for g in generic}
    good = []
    for g, s in scores.items():
        if significant(s, null):
            if _only_misfit(found, g, s.delta):
                found.misfit.add(g)
            else:
                good.append(g)
    return sorted(good, key=lambda g: scores[g].log_p)


def _only_misfit(found: Found, generic: int, left: float) -> bool:
    """Whether what is left is small beside an effect of the bench on the channel: shared by its channels."""
    bench = [b for b in found.on(found.axes(generic)) if len(found.pool.blocks[b].columns) > 1]
    return bool(bench) and left < MISFIT * max(found.share(b).delta for b in bench)


def explained(found: Found, lacking: Sequence[int], question: Question) -> None:
    """Take up what explains the strongest lack: one more library effect, two others, or an unknown."""
    if not (_named(found, lacking, question) or _pair(found, lacking, question)):
        _unknown(found, lacking, question)


def _named(found: Found, lacking: Sequence[int], question: Question) -> bool:
    """Whether a library effect stands for the generic alternative: that something is missing is sure by then.

    It must explain as much by the criterion, be significant as a single test, and leave nothing generic.
    """
    axes = found.axes(lacking[0])
    here = given(found.pool, found.all)
    candidates = free(found.pool, on(found.pool, question.library, axes), found.all)
    scores = {b: score(here, [b]) for b in candidates}
    scores = {b: s for b, s in scores.items() if s.m and s.log_p < np.log(SINGLE)}
    if not scores:
        return False
    best = max(scores, key=lambda b: scores[b].criterion)
    if _unnamed_is_better(found, axes, [*found.on(axes), best], question):
        return False
    tried = found.tried([*found.library, best])
    tried.refine(question)
    return _taken(found, tried, axes, question)


def _taken(found: Found, tried: Found, axes: set[int], question: Question) -> bool:
    """Whether what was tried leaves nothing generic on the channel; if so it is believed."""
    if on(tried.pool, lack_of_fit(tried, question), axes):
        return False
    found.pool, found.library = tried.pool, tried.library
    return True


def _unnamed_is_better(found: Found, axes: set[int], named: Sequence[int], question: Question) -> bool:
    """Whether one generic alternative explains the channel better than these library effects together."""
    here = found.without(*found.on(axes))
    together = delta(here, named) - sum(_penalty(here, b) for b in named)
    every = free(found.pool, on(found.pool, question.generic, axes), found.unknown)
    return together < max(score(here, [g]).criterion for g in every)


def _penalty(here: Pool, block: int) -> float:
    """What the criterion takes off Δ for a block's columns."""
    s = score(here, [block])
    return s.delta / s.s2 - s.criterion


def _pair(found: Found, lacking: Sequence[int], question: Question) -> bool:
    """Whether two library effects in place of what is believed on the channel leave nothing generic."""
    axes = found.axes(lacking[0])
    mine = found.on(axes)
    if len(mine) > 2 or not mine:
        return False
    best = _best_pair(found, axes, question)
    if best is None or _unnamed_is_better(found, axes, best, question):
        return False
    tried = found.tried([*(b for b in found.library if b not in mine), *best])
    tried.refine(question)
    if keys(tried.pool, tried.library) == keys(found.pool, found.library):
        return False
    null = null_of(given(tried.pool, tried.all), question.every, question.signs)
    size = len(tried.library)
    tried.drop_needless(null)
    return len(tried.library) == size and _taken(found, tried, axes, question)


def _best_pair(found: Found, axes: set[int], question: Question) -> tuple[int, int] | None:
    others = found.others(*found.on(axes))
    here = given(found.pool, others)
    candidates = free(found.pool, on(found.pool, question.library, axes), others)
    penalty = {b: _penalty(here, b) for b in candidates if score(here, [b]).m}
    pairs = {
        (a, b): delta(here, [a, b]) - penalty[a] - penalty[b]
        for a, b in combinations(penalty, 2)
        if found.pool.blocks[a].key != found.pool.blocks[b].key
    }
    return max(pairs, key=lambda p: pairs[p]) if pairs else None


def _unknown(found: Found, lacking: Sequence[int], question: Question) -> None:
    """The generic alternative that explains the channel best enters; library effects stay if they stand."""
    axes = found.axes(lacking[0])
    mine = found.on(axes)
    here = found.without(*mine)
    every = free(found.pool, on(found.pool, question.generic, axes), found.unknown)
    scores = {g: score(here, [g]).criterion for g in every}
    best = max(scores, key=lambda g: scores[g])
    if mine and score(here, mine).criterion >= scores[best]:
        # the library was right, and something comes on top
        left = given(found.pool, found.all)
        found.unknown.append(max(lacking, key=lambda g: score(left, [g]).criterion))
        return
    found.unknown.append(best)
    _only_what_stands(found, best, mine, question)


def _only_what_stands(found: Found, unknown: int, mine: Sequence[int], question: Question) -> None:
    """Library effects of the channel that keep most of their share beside the unknown; the others go."""
    axes = found.axes(unknown)
    alone = {b: score(found.without(b, unknown), [b]).delta for b in mine}
    for b in sorted(mine, key=lambda i: alone[i]):
        here = found.without(b)
        beside = score(here, [b])
        null = null_beside(here, found.others(b), question.every, question.signs)
        least = max(STAYS * alone[b], LEAST * found.size_of(unknown, axes))
        if not (significant(beside, null) and beside.delta >= least):
            found.library.remove(b)
