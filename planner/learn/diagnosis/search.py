"""Which candidates to believe: forward by criterion, swaps, backward, then lack of fit by what has no name.

A library effect enters when its family-wise p is at most ALPHA, the one with the best criterion first, and
may be swapped for another as others enter. When a generic alternative is still significant the library was
wrong about that channel: either two of its effects together are right, or something is missing that it does
not have; then the generic enters, and a library effect stays only if it explains most of its share beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from planner.learn.diagnosis.pool import Pool, Score, delta, family_wise, given, null_of, score
from planner.records import Array

ALPHA = 0.005  # false claims per sensor: half of what is allowed a channel
FEW = 60.0  # degrees of freedom, below which tails are longer than F's: ALPHA_FEW for those
ALPHA_FEW = 0.003
SINGLE = 1e-3  # p of one test at which an effect may stand for a generic alternative that is significant
MOST = 8  # effects a sensor; a unit that lacks more has another problem
STAYS = 0.5  # share of its Δ that a library effect must keep beside an unknown
# share of the unknown's Δ that it must have: bins follow no curve exactly, and their rest fits anything
LEAST = 0.3
MISFIT = 0.03  # of the Δ of a bench's effect: its geometry is known roughly, less than that names no other
Refine = Callable[[Pool, Sequence[int], int], tuple[Pool, int]]


@dataclass
class Found:
    """pool: with refined blocks at its end; library, unknown: blocks believed; p: block -> family-wise p

    misfit: generic blocks that are left beside a much stronger effect of the bench
    """

    pool: Pool
    library: list[int]
    unknown: list[int]
    p: dict[int, float] = field(default_factory=dict)
    misfit: set[int] = field(default_factory=set)

    @property
    def all(self) -> list[int]:
        """Everything believed."""
        return [*self.library, *self.unknown]


def search(pool: Pool, signs: Array, refine: Refine) -> Found:
    """What the pool's data say is missing; signs: (flips, segments) of ±1."""
    library = [i for i, b in enumerate(pool.blocks) if not b.generic]
    generic = [i for i, b in enumerate(pool.blocks) if b.generic]
    found = Found(pool, [], [])
    for _ in range(6):
        _forward(found, library, [*library, *generic], signs, refine)
        lacking = _lack_of_fit(found, library, generic, signs)
        if not lacking:
            break
        if _named(found, lacking, library, generic, signs, refine):
            continue
        if not _pair(found, lacking, library, generic, signs, refine):
            _unknown(found, lacking, library, signs, generic)
    _needless(found, library, generic, signs)
    _judge(found, library, generic, signs)
    return found


def significant(s: Score, null: Array) -> bool:
    """Whether a block's p over the whole family is small enough."""
    return bool(s.m and family_wise(s.log_p, null) <= (ALPHA if s.freedom > FEW else ALPHA_FEW))


def keys(pool: Pool, blocks: Sequence[int]) -> set[tuple[str, tuple[int, ...]]]:
    """Effect and channels of some blocks: the same for all values of a nonlinear parameter."""
    return {pool.blocks[b].key for b in blocks}


def free(pool: Pool, candidates: Sequence[int], taken: Sequence[int]) -> list[int]:
    """Candidates of another effect or channel than those taken."""
    gone = keys(pool, taken)
    return [b for b in candidates if pool.blocks[b].key not in gone]


# ---------------------------------------------------------------- forward


def _forward(
    found: Found, library: Sequence[int], family: Sequence[int], signs: Array, refine: Refine
) -> None:
    seen = {_state(found)}
    while len(found.library) < MOST:
        here = given(found.pool, found.all)
        null = null_of(here, free(found.pool, family, found.all), signs)
        scores = {b: score(here, [b]) for b in free(found.pool, library, found.all)}
        good = {b: s for b, s in scores.items() if significant(s, null)}
        good = {b: s for b, s in good.items() if _stands_beside(found, b, s)}
        if not good:
            return
        found.library.append(max(good, key=lambda b: good[b].criterion))
        _refined(found, refine)
        _swap(found, library)
        _refined(found, refine)
        _backward(found, null)
        if _state(found) in seen:
            return
        seen.add(_state(found))


def _state(found: Found) -> frozenset[tuple[str, tuple[int, ...]]]:
    """What is believed, whatever the nonlinear parameters: a search that returns to it goes in circles."""
    return frozenset(keys(found.pool, found.library))


def _stands_beside(found: Found, b: int, s: Score) -> bool:
    """Beside an unknown on its channel a library effect must keep most of what it explains alone."""
    axes = set(found.pool.blocks[b].columns)
    beside = [u for u in found.unknown if set(found.pool.blocks[u].columns) & axes]
    if not beside:
        return True
    alone = score(given(found.pool, [i for i in found.all if i not in beside]), [b])
    unnamed = max(_size_of(found, u, axes) for u in beside)
    return bool(s.delta >= max(STAYS * alone.delta, LEAST * unnamed))


def _size_of(found: Found, unknown: int, axes: set[int]) -> float:
    """Δ of an unknown with no library effect of its channel beside it."""
    others = [b for b in found.all if b != unknown and b not in _on(found.pool, found.library, axes)]
    return delta(given(found.pool, others), [unknown])


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


def _refined(found: Found, refine: Refine) -> None:
    """Every nonlinear parameter at its best value, between the values of the grid."""
    for i, b in enumerate(found.library):
        if found.pool.blocks[b].nonlinear:
            found.pool, found.library[i] = refine(found.pool, found.all, b)


def _backward(found: Found, null: Array) -> None:
    for b in list(found.library):
        others = [i for i in found.all if i != b]
        alone = score(given(found.pool, others), [b])
        if not significant(alone, null):
            found.library.remove(b)


# ---------------------------------------------------------------- lack of fit


def _lack_of_fit(found: Found, library: Sequence[int], generic: Sequence[int], signs: Array) -> list[int]:
    """The generic alternatives that are still significant, the strongest first."""
    here = given(found.pool, found.all)
    family = [*free(found.pool, library, found.all), *free(found.pool, generic, found.unknown)]
    null = null_of(here, family, signs)
    scores = {g: score(here, [g]) for g in free(found.pool, generic, found.unknown)}
    good = [g for g, s in scores.items() if significant(s, null)]
    for g in list(good):
        beside = _on(found.pool, found.library, set(found.pool.blocks[g].columns))
        beside = [b for b in beside if len(found.pool.blocks[b].columns) > 1]
        if beside and scores[g].delta < MISFIT * max(delta(_without(found, b), [b]) for b in beside):
            good.remove(g)
            found.misfit.add(g)
    return sorted(good, key=lambda g: scores[g].log_p)


def _without(found: Found, b: int) -> Pool:
    """The pool beside everything believed but one."""
    return given(found.pool, [i for i in found.all if i != b])


def _on(pool: Pool, blocks: Sequence[int], axes: set[int]) -> list[int]:
    return [b for b in blocks if set(pool.blocks[b].columns) & axes]


def _named(
    found: Found,
    lacking: Sequence[int],
    library: Sequence[int],
    generic: Sequence[int],
    signs: Array,
    refine: Refine,
) -> bool:
    """Whether a library effect stands for the generic alternative: that something is missing is sure by then.

    It must explain as much by the criterion, be significant as a single test, and leave nothing generic.
    """
    axes = set(found.pool.blocks[lacking[0]].columns)
    here = given(found.pool, found.all)
    scores = {b: score(here, [b]) for b in free(found.pool, _on(found.pool, library, axes), found.all)}
    scores = {b: s for b, s in scores.items() if s.m and s.log_p < np.log(SINGLE)}
    if not scores:
        return False
    best = max(scores, key=lambda b: scores[b].criterion)
    if _unnamed_is_better(found, lacking, [*_on(found.pool, found.library, axes), best], generic):
        return False
    tried = Found(found.pool, [*found.library, best], list(found.unknown))
    _refined(tried, refine)
    if _on(tried.pool, _lack_of_fit(tried, library, generic, signs), axes):
        return False
    found.pool, found.library = tried.pool, tried.library
    return True


def _unnamed_is_better(
    found: Found, lacking: Sequence[int], named: Sequence[int], generic: Sequence[int]
) -> bool:
    """Whether one generic alternative explains the channel better than these library effects together."""
    axes = set(found.pool.blocks[lacking[0]].columns)
    here = given(found.pool, [b for b in found.all if b not in _on(found.pool, found.library, axes)])
    singles = [score(here, [b]) for b in named]
    together = delta(here, named) - sum(s.delta / s.s2 - s.criterion for s in singles)
    every = free(found.pool, _on(found.pool, generic, axes), found.unknown)
    return together < max(score(here, [g]).criterion for g in every)


def _pair(
    found: Found,
    lacking: Sequence[int],
    library: Sequence[int],
    generic: Sequence[int],
    signs: Array,
    refine: Refine,
) -> bool:
    """Whether two library effects in place of what is believed on the channel leave nothing generic."""
    axes = set(found.pool.blocks[lacking[0]].columns)
    mine = _on(found.pool, found.library, axes)
    if len(mine) > 2 or not mine:
        return False
    others = [b for b in found.all if b not in mine]
    here = given(found.pool, others)
    candidates = [b for b in free(found.pool, _on(found.pool, library, axes), others) if score(here, [b]).m]
    penalty = {b: s.delta / s.s2 - s.criterion for b in candidates if (s := score(here, [b]))}
    pairs = {
        (a, b): delta(here, [a, b]) - penalty[a] - penalty[b]
        for a, b in combinations(candidates, 2)
        if found.pool.blocks[a].key != found.pool.blocks[b].key
    }
    if not pairs:
        return False
    best = max(pairs, key=lambda p: pairs[p])
    if _unnamed_is_better(found, lacking, best, generic):
        return False
    tried = Found(found.pool, [*[b for b in found.library if b not in mine], *best], list(found.unknown))
    _refined(tried, refine)
    if keys(tried.pool, tried.library) == keys(found.pool, found.library):
        return False
    null = null_of(given(tried.pool, tried.all), [*library, *generic], signs)
    size = len(tried.library)
    _backward(tried, null)
    if len(tried.library) < size or _on(tried.pool, _lack_of_fit(tried, library, generic, signs), axes):
        return False
    found.pool, found.library = tried.pool, tried.library
    return True


def _unknown(
    found: Found, lacking: Sequence[int], library: Sequence[int], signs: Array, generic: Sequence[int]
) -> None:
    """The generic alternative that explains the channel best enters; library effects stay if they stand."""
    axes = set(found.pool.blocks[lacking[0]].columns)
    mine = _on(found.pool, found.library, axes)
    here = given(found.pool, [b for b in found.all if b not in mine])
    every = free(found.pool, _on(found.pool, generic, axes), found.unknown)
    scores = {g: score(here, [g]).criterion for g in every}
    best = max(scores, key=lambda g: scores[g])
    if (
        mine and score(here, mine).criterion >= scores[best]
    ):  # the library was right, and something comes on top
        left = given(found.pool, found.all)
        found.unknown.append(max(lacking, key=lambda g: score(left, [g]).criterion))
        return
    found.unknown.append(best)
    alone = {
        b: score(given(found.pool, [i for i in found.all if i not in (b, best)]), [b]).delta for b in mine
    }
    for b in sorted(mine, key=lambda i: alone[i]):
        others = [i for i in found.all if i != b]
        beside = score(given(found.pool, others), [b])
        null = null_of(given(found.pool, others), free(found.pool, [*library, *generic], others), signs)
        least = max(STAYS * alone[b], LEAST * _size_of(found, best, axes))
        if not (significant(beside, null) and beside.delta >= least):
            found.library.remove(b)


# ---------------------------------------------------------------- the last word


def _needless(found: Found, library: Sequence[int], generic: Sequence[int], signs: Array) -> None:
    """An unknown that a library effect, found later, explains away is none."""
    for b in list(found.unknown):
        here = _without(found, b)
        null = null_of(here, free(found.pool, [*library, *generic], [i for i in found.all if i != b]), signs)
        if not significant(score(here, [b]), null):
            found.unknown.remove(b)


def _judge(found: Found, library: Sequence[int], generic: Sequence[int], signs: Array) -> None:
    """Family-wise p of everything believed, each beside the others, under the null of the bare model."""
    null = null_of(given(found.pool, []), [*library, *generic], signs)
    for b in found.all:
        beside = score(given(found.pool, [i for i in found.all if i != b]), [b])
        found.p[b] = max(family_wise(beside.log_p, null), float(np.finfo(float).tiny))
