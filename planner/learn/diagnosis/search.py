"""Which candidates to believe: forward by criterion, swaps, backward, then lack of fit by what has no name.

A library effect enters when its family-wise p is at most ALPHA, the one with the best criterion first, and
may be swapped for another as others enter. What is then left without a name is for `lack_of_fit`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.learn.diagnosis.found import Found, Question, free, keys, null_beside, on, significant
from planner.learn.diagnosis.lack_of_fit import LEAST, STAYS, explained, lack_of_fit
from planner.learn.diagnosis.pool import Pool, Score, family_wise, given, null_of, score

MOST = 8  # effects a sensor; a unit that lacks more has another problem
ROUNDS = 6  # of search and lack of fit


def search(pool: Pool, question: Question) -> Found:
    """What the pool's data say is missing."""
    found = Found(pool, [], [])
    for _ in range(ROUNDS):
        _forward(found, question)
        lacking = lack_of_fit(found, question)
        if not lacking:
            break
        explained(found, lacking, question)
    _needless(found, question)
    _judge(found, question)
    return found


# ---------------------------------------------------------------- forward


def _forward(found: Found, question: Question) -> None:
    seen = {_state(found)}
    while len(found.library) < MOST:
        here = given(found.pool, found.all)
        null = null_beside(here, found.all, question.every, question.signs)
        scores = {b: score(here, [b]) for b in free(found.pool, question.library, found.all)}
        good = {b: s for b, s in scores.items() if significant(s, null)}
        good = {b: s for b, s in good.items() if _stands_beside(found, b, s)}
        if not good:
            return
        found.library.append(max(good, key=lambda b: good[b].criterion))
        found.refine(question)
        _swap(found, question.library)
        found.refine(question)
        found.drop_needless(null)
        if _state(found) in seen:
            return
        seen.add(_state(found))


def _state(found: Found) -> frozenset[tuple[str, tuple[int, ...]]]:
    """What is believed, whatever the nonlinear parameters: a search that returns to it goes in circles."""
    return frozenset(keys(found.pool, found.library))


def _stands_beside(found: Found, b: int, s: Score) -> bool:
    """Beside an unknown on its channel a library effect must keep most of what it explains alone."""
    beside = on(found.pool, found.unknown, found.axes(b))
    if not beside:
        return True
    alone = score(found.without(*beside), [b])
    unnamed = max(found.size_of(u, found.axes(b)) for u in beside)
    return bool(s.delta >= max(STAYS * alone.delta, LEAST * unnamed))


def _swap(found: Found, library: Sequence[int]) -> None:
    """Exchange each believed effect for the best in its place, until nothing changes."""
    for _ in range(3):
        changed = False
        for i, b in enumerate(found.library):
            others = [*found.library[:i], *found.library[i + 1 :], *found.unknown]
            here = given(found.pool, others)
            rivals = {c: score(here, [c]).criterion for c in [*free(found.pool, library, others), b]}
            best = max(rivals, key=lambda c: rivals[c])
            if rivals[best] > rivals[b] + 1e-6:
                found.library[i], changed = best, True
        if not changed:
            return


# ---------------------------------------------------------------- the last word


def _needless(found: Found, question: Question) -> None:
    """An unknown that a library effect, found later, explains away is none."""
    for b in list(found.unknown):
        here = found.without(b)
        null = null_beside(here, found.others(b), question.every, question.signs)
        if not significant(score(here, [b]), null):
            found.unknown.remove(b)


def _judge(found: Found, question: Question) -> None:
    """Family-wise p of everything believed, each beside the others, under the null of the bare model."""
    null = null_of(found.pool, question.every, question.signs)
    for b in found.all:
        found.p[b] = max(family_wise(found.share(b).log_p, null), float(np.finfo(float).tiny))
