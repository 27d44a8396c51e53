"""What is left when no library effect is significant alone, told by alternatives that have no name.

When a generic alternative is still significant the library was wrong about that channel: either another of
its effects stands for it, or two of them together are right, or something is missing that it does not have;
then the generic enters, and a library effect stays only if it explains most of its share beside it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from planner.diagnose.hypotheses.found import (
    ALPHA_UNKNOWN,
    SINGLE,
    TIE,
    Found,
    Question,
    along,
    best_of,
    free,
    keys,
    on,
    significant,
)
from planner.diagnose.hypotheses.of_one_channel import of_one_channel_alone
from planner.diagnose.hypotheses.parity import unlike_parity
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.hypotheses.scores import Score, chance_of, delta, nulls_of, score
from planner.diagnose.references.references import hypothesis
from planner.diagnose.shapes.generic import VARIES_WITH

STAYS = 0.5  # share of its Δ that a library effect must keep beside an unknown
# share of the unknown's Δ that it must have: bins follow no curve exactly, and their rest fits anything
LEAST = 0.3
MOST_OF_BOTH = 0.9  # of what library and generic explain together, from which the library is right
CHAIN = 3  # library effects on one channel, from which one variable may be the simpler explanation
ONE_VARIABLE = 0.95  # of what it and the library effects explain together, from which it is
# share of an effect's Δ that may be left although it is the right one
SHARED_MISFIT = 0.03  # of what several channels share, an effect of the bench: its geometry is known roughly
DECISIVE = 10.0  # of the criterion: "very strong", Kass and Raftery, Bayes factors, 1995, 3.2
BOTH = "_and_"  # between the variables of a generic alternative over two
OWN_MISFIT = 0.1  # over the variable that drives it: that is read with noise, and bins average it


def lack_of_fit(found: Found, question: Question) -> list[int]:
    """The generic alternatives that are still significant, the strongest first."""
    here = found.without()
    generic = free(found.pool, question.generic, found.unknown)
    null = nulls_of(here, [*free(found.pool, question.library, found.all), *generic], question.flips)
    scores = {g: score(here, [g]) for g in generic}
    good = []
    for g, s in scores.items():
        # no table over temperature is exact: many rows make its bends significant, the criterion does not
        if s.criterion > 0.0 and significant(here, g, s, null, ALPHA_UNKNOWN):
            if _only_misfit(found, g, s.delta):
                found.misfit.add(g)
            else:
                good.append(g)
    return sorted(good, key=lambda g: scores[g].log_p)


def _only_misfit(found: Found, generic: int, left: float) -> bool:
    """Whether what is left is small beside an effect of the channel whose shape is known only so well.

    An effect of the bench has a geometry, one that follows a variable has readings of it.
    """
    pool = found.pool
    for b in found.on(found.axes(generic)):
        block = pool.blocks[b]
        known = hypothesis(block.name).misfit or (SHARED_MISFIT if len(block.columns) > 1 else 0.0)
        if own_variable(pool, b, generic):
            known = max(known, OWN_MISFIT)
        if (
            known > 0.0
            and left < known * found.share(b).delta
            and not of_one_channel_alone(found, generic, b)
        ):
            return True
    return False


def own_variable(pool: Pool, b: int, generic: int) -> bool:
    """Whether a generic alternative is over the variable along which a library effect runs."""
    variable = hypothesis(pool.blocks[b].name).variable
    return VARIES_WITH.get(variable) == pool.blocks[generic].name


def of_the_bench(found: Found, b: int) -> bool:
    """Whether a believed block is of the bench: a reference, or an effect that does not fly."""
    return bool(hypothesis(found.pool.blocks[b].name).bench_only)


def bench_misfit(found: Found, b: int, left: float) -> bool:
    """Whether an effect is no more than what the geometry of a stronger one of the bench may miss."""
    own = found.share(b).delta if b in found.library else left
    here = [found.pool.blocks[r].name for r in found.on(found.axes(b)) if r != b]
    if "thermometer_lag" in here and hypothesis(found.pool.blocks[b].name).variable == "temperature_rate":
        return True  # the same ramps show both, and the lag's own curves are known only so well
    for r in found.on(found.axes(b)):
        if r != b and of_the_bench(found, r) and found.share(r).delta > own:
            known = max(hypothesis(found.pool.blocks[r].name).misfit, SHARED_MISFIT)
            if left < known * found.share(r).delta and not of_one_channel_alone(found, b, r):
                return not _is_the_rest(found, b, own)
    return False


def _is_the_rest(found: Found, b: int, own: float) -> bool:
    """Whether an effect of the bench is nearly all that the others leave: an arm bends, and is longer.

    What the geometry of a stronger effect misses has no equation, and none explains it down to the noise.
    """
    if not of_the_bench(found, b):
        return False
    state = [found.pool.state[axis] for axis in found.axes(b)]
    rest = sum(float(w.z @ w.z) - len(w.z) for w in state) - score(found.pool, found.others(b)).delta
    return own >= MOST_OF_BOTH * rest


def stands_beside(found: Found, b: int, s: Score) -> bool:
    """Beside an unknown on its channel a library effect must keep most of what it explains alone."""
    if bench_misfit(found, b, s.delta):
        return False
    beside = on(found.pool, found.unknown, found.axes(b))
    if not beside:
        return True
    alone = score(found.without(*beside), [b])
    unnamed = max(found.size_of(u, found.axes(b)) for u in beside)
    return bool(s.delta >= max(STAYS * alone.delta, LEAST * unnamed))


def cut_chains(found: Found, question: Question) -> None:
    """Many library effects on a channel where one variable explains as much are the bends of one curve.

    So are two that run along that variable itself: a load that saturates is a cubic and a square, roughly.

    A strong effect that the library does not have looks like one that it has, and its misfit like others.
    """
    for axis in found.pool.axes:
        mine = found.on({axis})
        unnamed = free(found.pool, on(found.pool, question.generic, {axis}), found.unknown)
        if len(mine) < CHAIN:
            unnamed = [g for g in unnamed if found.pool.blocks[g].name == _same_variable(found.pool, mine)]
        if not unnamed:
            continue
        before = on(found.pool, found.unknown, {axis})
        here = found.without(*mine, *before)
        together = {g: delta(here, [*mine, g]) for g in unnamed}
        enough = [g for g in unnamed if delta(here, [g]) >= ONE_VARIABLE * together[g]]
        if not enough:
            continue
        best = simplest(found.pool, {g: score(here, [g]).criterion for g in enough})
        both = together[best]
        if not _tells_all(found, here, mine, best, question):
            found.stands_for(best, mine, question)
            found.unknown = [*(u for u in found.unknown if u not in before), best]
            _only_what_counts(found, best, mine, both)
            found.drop_needless(found.chance(question))


def _tells_all(found: Found, here: Pool, mine: Sequence[int], unnamed: int, question: Question) -> bool:
    """Whether a channel's library effects leave nothing generic, while the one variable leaves another.

    Then the equation is right. K's k1 a + k2 a² is a pair along the load, whose bins leave what rates make
    of it. A load that saturates is a pair as well, roughly, and bins of the load leave nothing of it. Of an
    odd name and an even one neither has the other's bends: that they leave nothing is enough. Each bin more
    than they have could have been anything up to the curve's own size: that it is nothing is a coincidence.
    """
    axes = found.axes(unnamed)
    named = delta(here, mine) / score(here, mine).s2 - sum(penalty(here, b) for b in mine)
    apart, curve_alone = unlike_parity(found.pool, mine), score(here, [unnamed])
    more = curve_alone.m - sum(score(here, [b]).m for b in mine)
    each = penalty(here, unnamed) / curve_alone.m  # log of rows, by which bins pay
    named += apart * more * max(np.log(max(curve_alone.delta / curve_alone.s2, 1.0)) - each, 0.0)
    if named < curve_alone.criterion + DECISIVE:
        return False
    curve = found.tried([b for b in found.library if b not in mine])
    curve.unknown = [*(u for u in found.unknown if u not in on(found.pool, found.unknown, axes)), unnamed]
    pair = found.tried(found.library)
    pair.misfit, curve.misfit = set(found.misfit), set(found.misfit)
    left = [on(f.pool, lack_of_fit(f, question), axes) for f in (pair, curve)]
    return not left[0] and (bool(left[1]) or apart)


def pairs_for_tables(found: Found, question: Question) -> None:
    """A table that two effects of fewer columns beat decisively was those two, as far as either is sure.

    On an arm the rate goes with the load, so a table over the rate follows k1 a + k2 a² roughly.
    """
    for axis in found.pool.axes:
        mine = found.on({axis})
        if len(mine) != 1 or on(found.pool, found.unknown, {axis}) or len(found.axes(mine[0])) > 1:
            continue
        here = found.without(*mine)
        own = [b for b in question.library if not found.pool.blocks[b].reference]
        pair = _best_pair(found, {axis}, own) if score(here, mine).m > 2 else None
        if pair is None or sum(score(here, [b]).m for b in pair) >= score(here, mine).m:
            continue
        together = delta(here, pair) - sum(penalty(here, b) for b in pair)
        # one coefficient may be all there is of it, and pays for itself alone
        if (
            together
            < max(score(here, mine).delta - penalty(here, mine[0]), score(here, mine).among_names) + DECISIVE
        ):
            continue
        tried = found.tried([*(b for b in found.library if b not in mine), *pair])
        tried.refine(question)
        tried.drop_needless(nulls_of(tried.without(), question.every, question.flips))
        if tried.on({axis}):
            _taken(found, tried, {axis}, question)


def _same_variable(pool: Pool, mine: Sequence[int]) -> str:
    """The variable along which a pair of a channel's own effects runs: two powers of one input; else ""."""
    if len(mine) != CHAIN - 1 or any(len(pool.blocks[b].columns) > 1 for b in mine):
        return ""
    variables = {along(pool, b) for b in mine}
    return variables.pop() if len(variables) == 1 else ""


def explained(found: Found, lacking: Sequence[int], question: Question) -> None:
    """Take up what explains the strongest lack: one more library effect, two others, or an unknown."""
    if not (_named(found, lacking, question) or _pair(found, lacking, question)):
        _unknown(found, lacking, question)


def _named(found: Found, lacking: Sequence[int], question: Question) -> bool:
    """Whether a library effect stands for the generic alternative: that something is missing is sure by then.

    It must explain as much by the criterion, be significant as a single test, and leave nothing generic.
    """
    axes = found.axes(lacking[0])
    here = found.without()
    candidates = free(found.pool, on(found.pool, question.library, axes), found.all)
    scores = {b: score(here, [b]) for b in candidates}
    scores = {b: s for b, s in scores.items() if s.m and s.log_p < np.log(SINGLE)}
    scores = {b: s for b, s in scores.items() if stands_beside(found, b, s)}
    scores = {b: s for b, s in scores.items() if found.may_be(b)}
    if not scores:
        return False
    criteria = found.criteria(question, scores)
    best = best_of(found.pool, criteria)
    if _unnamed_is_better(found, axes, [*found.on(axes), best], question):
        return False
    tried = found.tried([*found.library, best])
    tried.stood_for[found.pool.blocks[best].key] = _p_beside(found, lacking[0], question)
    tried.refine(question)
    return _taken(found, tried, axes, question)


def _p_beside(found: Found, generic: int, question: Question) -> float:
    """Family-wise p of what is lacking beside everything believed."""
    return chance_of(found.pool, generic, score(found.without(), [generic]), found.chance(question))


def _taken(found: Found, tried: Found, axes: set[int], question: Question) -> bool:
    """Whether what was tried leaves nothing generic on the channel; if so it is believed."""
    if on(tried.pool, lack_of_fit(tried, question), axes):
        return False
    found.pool, found.library, found.stood_for = tried.pool, tried.library, tried.stood_for
    return True


def _unnamed_is_better(found: Found, axes: set[int], named: Sequence[int], question: Question) -> bool:
    """Whether one generic alternative explains the channel better than these library effects together."""
    here = found.without(*found.on(axes))
    together = delta(here, named) - sum(penalty(here, b) for b in named)
    together += sum(found.alike(b, found.library) for b in named)
    every = free(found.pool, on(found.pool, question.generic, axes), found.unknown)
    return together < max(score(here, [g]).criterion for g in every)


def penalty(here: Pool, block: int) -> float:
    """What the criterion takes off Δ for a block's columns."""
    s = score(here, [block])
    return s.delta / s.s2 - s.criterion


def _pair(found: Found, lacking: Sequence[int], question: Question) -> bool:
    """Whether two library effects in place of what is believed on the channel leave nothing generic."""
    axes = found.axes(lacking[0])
    mine = found.on(axes)
    if len(mine) > 2 or not mine or on(found.pool, found.unknown, axes):
        return False
    best = _best_pair(found, axes, question.library)
    if best is None or _unnamed_is_better(found, axes, best, question):
        return False
    tried = found.tried([*(b for b in found.library if b not in mine), *best])
    tried.refine(question)
    if keys(tried.pool, tried.library) == keys(found.pool, found.library):
        return False
    null = nulls_of(tried.without(), question.every, question.flips)
    size = len(tried.library)
    tried.drop_needless(null)
    return len(tried.library) == size and _taken(found, tried, axes, question)


def _best_pair(found: Found, axes: set[int], library: Sequence[int]) -> tuple[int, int] | None:
    mine = found.on(axes)
    here = found.without(*mine)
    candidates = free(found.pool, on(found.pool, library, axes), found.others(*mine))
    candidates = [b for b in candidates if found.may_be(b, *mine)]
    costs = {b: penalty(here, b) for b in candidates if score(here, [b]).m}
    pairs = {
        (a, b): delta(here, [a, b]) - costs[a] - costs[b]
        for a, b in combinations(costs, 2)
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
    best = simplest(found.pool, scores)
    if mine and score(here, mine).criterion >= scores[best] - TIE:
        # the library was right, and something comes on top: on two days bins of them are an ageing, but for
        # what rounding leaves of either
        left = found.without()
        found.unknown.append(max(lacking, key=lambda g: score(left, [g]).criterion))
        return
    if best != lacking[0]:
        found.stood_for[found.pool.blocks[best].key] = _p_beside(found, lacking[0], question)
    found.unknown.append(best)
    both = delta(here, [*mine, best])
    own = any(own_variable(found.pool, b, best) for b in mine)
    if mine and (question.flips.few_runs or own) and delta(here, mine) >= MOST_OF_BOTH * both:
        _only_what_counts(found, best, mine, both)
    else:
        _only_what_stands(found, best, mine, question)


def simplest(pool: Pool, scores: Mapping[int, float]) -> int:
    """The best criterion; a curve over one variable before one over it and another that is hardly better.

    On an arm the load grows with the time since power-on, and what changes in time by another amount at every
    rate follows any curve over the rate: both variables are more of a claim, and must be decisively better.
    """
    best = max(scores, key=lambda g: scores[g])
    of = pool.blocks[best].name.split(BOTH)
    one = [g for g in scores if len(of) > 1 and pool.blocks[g].name in of]
    return max([g for g in one if scores[g] > scores[best] - DECISIVE] or [best], key=lambda g: scores[g])


def _only_what_counts(found: Found, unknown: int, mine: Sequence[int], both: float) -> None:
    """Library effects that explain nearly all that the unknown does are aliased with it, and stand.

    In one long record temperature, its rate and time all go together, and fine bins of time follow anything;
    elsewhere bins of an effect's own variable follow the noise with which that variable is read.
    Only those that count go in: each has a share of its own beside the other library effects.
    """
    for b in sorted(mine, key=lambda i: delta(found.without(i, unknown), [i])):
        if delta(found.without(b, unknown), [b]) >= LEAST * both:
            found.aliased.add(found.pool.blocks[b].key)
        else:
            found.library.remove(b)


def _only_what_stands(found: Found, unknown: int, mine: Sequence[int], question: Question) -> None:
    """Library effects of the channel that keep most of their share beside the unknown; the others go."""
    axes = found.axes(unknown)
    alone = {b: score(found.without(b, unknown), [b]).delta for b in mine}
    for b in sorted(mine, key=lambda i: alone[i]):
        beside = score(found.without(b), [b])
        null = found.chance(question, b)
        least = max(STAYS * alone[b], LEAST * found.size_of(unknown, axes))
        if not (found.enters(b, beside, null) and beside.delta >= least):
            found.library.remove(b)
