"""What a search has come to believe, and the rules by which it believes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner.diagnose.hypotheses.agreement import (
    channels_disagree,
    of_one_channel,
    others_have_their_own,
    seen_by_one,
)
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.chance import Flips, Nulls
from planner.diagnose.hypotheses.foreseen import as_foreseen
from planner.diagnose.hypotheses.one_temperature import odds_at_one_temperature
from planner.diagnose.hypotheses.parity import power
from planner.diagnose.hypotheses.pool import Pool, given
from planner.diagnose.hypotheses.scores import Score, chance_of, delta, nulls_of, score
from planner.diagnose.references.references import ONE_SCALE, REFERENCES, hypothesis
from planner.diagnose.shapes.generic import VARIES_WITH, of_the_sensor

ALPHA = 0.01  # false claims per sensor, of three channels, where nothing else is believed
ALPHA_FURTHER = 0.002  # beside what is believed, whose misfit looks like more
ALPHA_REFERENCE = 0.001  # of what would be wrong with all channels at once
LESS_READILY = 2.0 * np.log(ALPHA / ALPHA_REFERENCE)  # of the criterion, 2 log of odds
ALPHA_UNKNOWN = 0.0005  # for what has no name: wide blocks, to which noise of another colour looks like much
FAMILIES = 6  # of a sensor, each asked by flips of its own: two of each channel
FEW = 60.0  # degrees of freedom, below which tails are longer than F's
OF_FEW = 0.5  # of the chance that those may take: what the longer tails add
SINGLE = 1e-3  # p of one test at which an effect may stand for a generic alternative that is significant
CLOSE = 0.8  # of the best criterion, from which one between two values of the grid may be the best
ALIKE = 2.0 * np.log(30.0)  # of the criterion: a name that another channel has, of thirty that there are
TIE = 0.1  # of the criterion, that is no difference
ROUNDED = 6  # digits behind the point of a criterion, beyond which two columns are one and the same
GROUPS = ("bias", "scale_factor", "misalignment")  # the simplest first
Key = tuple[str, tuple[int, ...]]
Refine = Callable[[Pool, Sequence[int], int], tuple[Pool, int]]


@dataclass(frozen=True)
class Question:
    """What is asked of a pool. library, generic: its blocks; flips: of the residual of the full model

    refine: (pool, believed, block) -> pool with the block at its best nonlinear parameter, and its number
    slopes: (found, block) -> what the block adds, derived by its parameters, as a block; None: it has none
    """

    library: tuple[int, ...]
    generic: tuple[int, ...]
    flips: Flips
    refine: Refine
    slopes: Callable[[Found, int], Block | None]

    @property
    def every(self) -> tuple[int, ...]:
        """All blocks that are tested together."""
        return (*self.library, *self.generic)

    @property
    def least_p(self) -> float:
        """The smallest p that is said: with few power-ons none beyond what the flips can tell."""
        return (
            FAMILIES / (1.0 + len(self.flips.signs)) if self.flips.few_runs else float(np.finfo(float).tiny)
        )


@dataclass
class Found:
    """pool: with refined blocks at its end; library, unknown: blocks believed; p: block -> family-wise p

    misfit: generic blocks that are left beside a much stronger effect of the bench
    aliased: library effects (their keys) that stand although an unknown of their channel could take them up
    stood_for: blocks (their keys) -> p of what was significant where they stand now: bins, or other names
    """

    pool: Pool
    library: list[int]
    unknown: list[int]
    p: dict[int, float] = field(default_factory=dict)
    misfit: set[int] = field(default_factory=set)
    aliased: set[Key] = field(default_factory=set)
    stood_for: dict[Key, float] = field(default_factory=dict)

    @property
    def all(self) -> list[int]:
        """Everything believed."""
        return [*self.library, *self.unknown]

    def others(self, *blocks: int) -> list[int]:
        """Everything believed but these."""
        return [b for b in self.all if b not in blocks]

    def without(self, *blocks: int) -> Pool:
        """The pool beside everything believed but these."""
        return given(self.pool, self.others(*blocks))

    def chance(self, question: Question, *blocks: int) -> Nulls:
        """What chance does among all that is still a candidate beside everything believed but these."""
        taken = self.others(*blocks)
        return nulls_of(self.without(*blocks), free(self.pool, question.every, taken), question.flips)

    def share(self, block: int) -> Score:
        """What a block explains beside everything else that is believed, but not beside its alias."""
        return score(self.without(block, *self.alias(block)), [block])

    def alias(self, block: int) -> list[int]:
        """The unknowns that could take up a library effect which stands all the same."""
        return on(self.pool, self.unknown, self.axes(block)) if self.stands(block) else []

    def stands(self, block: int) -> bool:
        """Whether a library effect stands although an unknown of its channel could take it up."""
        return self.pool.blocks[block].key in self.aliased

    def on(self, axes: set[int]) -> list[int]:
        """The library effects that are believed on some channels."""
        return on(self.pool, self.library, axes)

    def axes(self, block: int) -> set[int]:
        """The channels of a block."""
        return set(self.pool.blocks[block].columns)

    def size_of(self, unknown: int, axes: set[int]) -> float:
        """Δ of an unknown with no library effect of these channels beside it."""
        return delta(self.without(unknown, *self.on(axes)), [unknown])

    def tried(self, library: Sequence[int]) -> Found:
        """The same with other library effects, to be kept or thrown away."""
        return replace(self, library=list(library), unknown=list(self.unknown), aliased=set(self.aliased),
                       stood_for=dict(self.stood_for))  # fmt: skip

    def stands_for(self, block: int, names: Iterable[int], question: Question) -> None:
        """A block comes where believed effects stand: that something is there stays as sure as they made it.

        Bins have more columns than an equation, and most lie where few power-ons tell the noise: what was
        there at 1e-8 by a name that they beat decisively was not significant any more, and the channel clean.
        """
        null, pool = self.chance(question), self.pool
        sure = [self.stood_for.get(pool.blocks[b].key, 1.0) for b in (block, *names)]
        sure += [self.p[b] if b in self.p else chance_of(pool, b, self.share(b), null) for b in names]
        self.stood_for[pool.blocks[block].key] = min(sure)

    def may_stay(self, block: int, s: Score) -> bool:
        """Whether a block stands where something was significant, and tells something itself.

        What it stands for may have ceased to be: with its time constant refined a warm-up came to lie in
        the other of its channel's two families, and was claimed with a p of 0.18 in place of itself.
        """
        return self.stood_for.get(self.pool.blocks[block].key, 1.0) <= ALPHA and s.log_p < np.log(SINGLE)

    def refine(self, question: Question) -> None:
        """Every nonlinear parameter at its best value, between the values of the grid."""
        for i, b in enumerate(self.library):
            if self.pool.blocks[b].nonlinear:
                self.pool, self.library[i] = question.refine(self.pool, self.all, b)

    def criteria(
        self, question: Question, scores: Mapping[int, Score], b: int | None = None
    ) -> dict[int, float]:
        """Block -> criterion among names, beside everything believed but b; also between the grid's points.

        Few points of several parameters together lie far apart, and the nearest may explain less than an
        effect that is not there. Those of one parameter are asked so where the nearest comes close to the
        best: of a warm-up of sixty sigma the next time constant misses so much that a table explains more.
        Three channels are of one kind: what one of them has the others are likely to have, each of its size.
        """
        beside = self.all if b is None else self.others(b)
        found = {c: s.among_names + self.beforehand(c, beside) for c, s in scores.items()}
        best: dict[Key, int] = {}
        for c in sorted(scores, key=lambda c: -found[c]):
            if self.pool.blocks[c].nonlinear:
                best.setdefault(self.pool.blocks[c].key, c)
        for c in best.values():
            if len(self.pool.blocks[c].nonlinear) > 1 or self._is_close(c, found):
                self.pool, moved = question.refine(self.pool, beside, c)
                if moved != c:
                    found[moved] = score(given(self.pool, beside), [moved]).among_names
                    found[moved] += self.beforehand(moved, beside)
        return found

    def beforehand(self, block: int, beside: Iterable[int]) -> float:
        """What the criterion owes a name by what is known before it is asked."""
        return self.alike(block, beside) + odds_at_one_temperature(self.pool, block)

    def alike(self, block: int, beside: Iterable[int]) -> float:
        """What the criterion owes an effect of one channel that another has as well, by that alone."""
        one = self.pool.blocks[block]
        others = (self.pool.blocks[i] for i in beside if len(self.pool.blocks[i].columns) == 1)
        if one.generic or len(one.columns) > 1:
            return 0.0
        return ALIKE if any(x.name == one.name and x.key != one.key for x in others) else 0.0

    def _is_close(self, block: int, criteria: Mapping[int, float]) -> bool:
        """Whether a block comes close to the best of another name, or is the best and another comes close."""
        own = self.pool.blocks[block].key
        others = max((x for c, x in criteria.items() if self.pool.blocks[c].key != own), default=-np.inf)
        least, most = sorted((criteria[block], others))
        return least >= CLOSE * most > 0.0

    def drop_needless(self, null: Nulls) -> None:
        """Backward elimination: library effects that are not significant beside the others go."""
        for b in list(self.library):
            s = self.share(b)
            stands = self.may_stay(b, s) and self.may_be(b)
            if not (stands or self.enters(b, s, null)):
                self.library.remove(b)

    def enters(self, block: int, s: Score, null: Nulls) -> bool:
        """Whether a block of the library may be believed beside the others, by its score there."""
        reference = self.pool.blocks[block].reference
        alpha = ALPHA_REFERENCE if reference else ALPHA_FURTHER if self.others(block) else ALPHA
        if not significant(self.pool, block, s, null, alpha if s.freedom > FEW else OF_FEW * alpha):
            return False
        return self.may_be(block)

    def may_be(self, block: int, *instead: int) -> bool:
        """Whether several channels see what the bench has and agree, as the rest of the table says it is.

        Of an effect of the library whose geometry is known roughly no agreement is asked, and in the place of
        another it may be what the others are as well; but an arm is as much longer for every channel, and a
        reading in steps of one of them was its length. instead: believed ones whose place it takes
        """
        b = self.pool.blocks[block]
        if len(b.columns) == 1:
            return True
        here = self.without(block, *instead)
        if not b.reference:
            if getattr(hypothesis(b.name), "one_scale", False) and channels_disagree(here, block, ONE_SCALE):
                return False
            return bool(instead) or not others_have_their_own(self.pool, here, block)
        if others_have_their_own(self.pool, here, block):
            return False
        r = REFERENCES[b.name]
        if not as_foreseen(self.pool, here, block) or channels_disagree(here, block, r.unlike):
            return False
        if r.by_channel:
            return not seen_by_one(here, block)
        # neither beside what is believed nor by itself: a name of one channel takes that one's share of it
        return not (of_one_channel(here, block) and of_one_channel(self.pool, block))


def significant(pool: Pool, block: int, s: Score, null: Nulls, alpha: float) -> bool:
    """Whether a block's p over the whole family is small enough."""
    return chance_of(pool, block, s, null) <= alpha


def best_of(pool: Pool, scores: Mapping[int, float]) -> int:
    """The best criterion; of those that are as good the simplest, a bias before what an input drives.

    Where power-ons have levels of their own, ageing is a drift within them, and rounding is no reason.
    """
    most = max(scores.values()) - TIE

    def rank(b: int) -> tuple[int, float, bool, float]:
        return _driven(pool, b), -round(scores[b], ROUNDED), _of_days(pool, b), -scores[b]

    tied = [b for b in scores if scores[b] >= most]
    best = _said_by_the_library(pool, scores, min(tied, key=rank))
    named = {pool.blocks[b].key: b for b in sorted(tied, key=rank, reverse=True) if b != best}
    own = pool.blocks[best].key
    one_law = [best, *(b for key, b in named.items() if key != own and _one_law(pool, b, best))]
    if len(one_law) == 1:
        return best
    return min(one_law, key=lambda b: (_unusual(pool, b), power(pool, b), rank(b)))


def _said_by_the_library(pool: Pool, scores: Mapping[int, float], best: int) -> int:
    """The library's effect of which a reference error says the same of some records, where it does as well.

    A lever arm in turns of the table alone, or wherever something turns: what is of the bench alone is
    believed as much less readily as its level says. An arm of 24 sigma, 0.2 of Δ apart, was no effect.
    """
    if not pool.blocks[best].reference:
        return best
    said, least = REFERENCES[pool.blocks[best].name].said, scores[best] - LESS_READILY
    same = (b for b in scores if pool.blocks[b].name == said and not pool.blocks[b].reference)
    return max((b for b in same if scores[b] > least), key=lambda b: scores[b], default=best)


def _one_law(pool: Pool, b: int, best: int) -> bool:
    """Whether two tied effects are one law to these records: of the same variable and the same parameters.

    As a warm-up and a settling are, or |f| ω and |f|² ω where |f| stays near 1 g: the lower power is simpler.
    """
    one, other = pool.blocks[b], pool.blocks[best]
    if any(x.generic or x.reference for x in (one, other)) or one.channels != other.channels:
        return False
    same = hypothesis(one.name).variable == hypothesis(other.name).variable
    return same and one.nonlinear.keys() == other.nonlinear.keys()


def _unusual(pool: Pool, b: int) -> float:
    """How far a block's smooth parameters lie from what is usual of its effect, as a fit carries them.

    exp(−t / τ) is 1 − exp(−t / τ) but for a constant, and rounding chose between them: of 41 s, eight times
    what a settling takes and a fifteenth of a warm-up, the former is the likelier name.
    """
    block = pool.blocks[b]
    smooth = (p for p in hypothesis(block.name).parameters if not p.stepped)
    return sum(abs(p.carried(block.nonlinear[p.name]) - p.carried(p.default)) for p in smooth)


def _of_days(pool: Pool, block: int) -> bool:
    b = pool.blocks[block]
    return not b.generic and "day" in hypothesis(b.name).needs


def _driven(pool: Pool, block: int) -> int:
    b = pool.blocks[block]
    return 0 if b.generic else GROUPS.index(hypothesis(b.name).group)


def keys(pool: Pool, blocks: Iterable[int]) -> set[Key]:
    """Effect and channels of some blocks: the same for all values of a nonlinear parameter."""
    return {pool.blocks[b].key for b in blocks}


def free(pool: Pool, candidates: Sequence[int], taken: Sequence[int]) -> list[int]:
    """Candidates of another effect or channel than those taken."""
    gone = keys(pool, taken)
    return [b for b in candidates if pool.blocks[b].key not in gone]


def on(pool: Pool, blocks: Sequence[int], axes: set[int]) -> list[int]:
    """Those of some blocks that act on some channels."""
    return [b for b in blocks if set(pool.blocks[b].columns) & axes]


def along(pool: Pool, b: int) -> str:
    """The generic alternative over a library effect's variable."""
    name = VARIES_WITH.get(hypothesis(pool.blocks[b].name).variable, "")
    return of_the_sensor(name, pool.blocks[b].sensor)
