"""What a search has come to believe, and the rules by which it believes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

from planner.learn.diagnosis.pool import Pool, Score, delta, family_wise, given, null_of, score
from planner.records import Array

ALPHA = 0.005  # false claims per sensor: half of what is allowed a channel
FEW = 60.0  # degrees of freedom, below which tails are longer than F's: ALPHA_FEW for those
ALPHA_FEW = 0.003
Refine = Callable[[Pool, Sequence[int], int], tuple[Pool, int]]


@dataclass(frozen=True)
class Question:
    """What is asked of a pool. library, generic: its blocks; signs: (flips, segments) of ±1

    refine: (pool, believed, block) -> pool with the block at its best nonlinear parameter, and its number
    """

    library: tuple[int, ...]
    generic: tuple[int, ...]
    signs: Array
    refine: Refine

    @property
    def every(self) -> tuple[int, ...]:
        """All blocks that are tested together."""
        return (*self.library, *self.generic)


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

    def others(self, *blocks: int) -> list[int]:
        """Everything believed but these."""
        return [b for b in self.all if b not in blocks]

    def without(self, *blocks: int) -> Pool:
        """The pool beside everything believed but these."""
        return given(self.pool, self.others(*blocks))

    def share(self, block: int) -> Score:
        """What a block explains beside everything else that is believed."""
        return score(self.without(block), [block])

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
        return replace(self, library=list(library), unknown=list(self.unknown))

    def refine(self, question: Question) -> None:
        """Every nonlinear parameter at its best value, between the values of the grid."""
        for i, b in enumerate(self.library):
            if self.pool.blocks[b].nonlinear:
                self.pool, self.library[i] = question.refine(self.pool, self.all, b)

    def drop_needless(self, null: Array) -> None:
        """Backward elimination: library effects that are not significant beside the others go."""
        for b in list(self.library):
            if not significant(self.share(b), null):
                self.library.remove(b)


def null_beside(here: Pool, taken: Sequence[int], family: Sequence[int], signs: Array) -> Array:
    """(flips,) smallest log p of what is still a candidate beside what is taken."""
    return null_of(here, free(here, family, taken), signs)


def significant(s: Score, null: Array) -> bool:
    """Whether a block's p over the whole family is small enough."""
    return bool(s.m and family_wise(s.log_p, null) <= (ALPHA if s.freedom > FEW else ALPHA_FEW))


def keys(pool: Pool, blocks: Iterable[int]) -> set[tuple[str, tuple[int, ...]]]:
    """Effect and channels of some blocks: the same for all values of a nonlinear parameter."""
    return {pool.blocks[b].key for b in blocks}


def free(pool: Pool, candidates: Sequence[int], taken: Sequence[int]) -> list[int]:
    """Candidates of another effect or channel than those taken."""
    gone = keys(pool, taken)
    return [b for b in candidates if pool.blocks[b].key not in gone]


def on(pool: Pool, blocks: Sequence[int], axes: set[int]) -> list[int]:
    """Those of some blocks that act on some channels."""
    return [b for b in blocks if set(pool.blocks[b].columns) & axes]
