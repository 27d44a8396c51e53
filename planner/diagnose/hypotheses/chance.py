"""What chance does to the smallest p of a family: by random signs, and by how many tests that amounts to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from planner.nouns.array import Array


@dataclass(frozen=True)
class Flips:
    """Random signs of segments. signs: (flips, segments) of ±1

    few_runs: the colour of the noise is then not known, and one long record's variables all go together. Its
    remainder has no slow part left, the candidates took it, and the flips look like fewer tests than there
    are: blocks count as so many independent ones at least.
    """

    signs: Array
    few_runs: bool


@dataclass(frozen=True)
class Null:
    """What chance does. least: (flips,) smallest log p over a family; tests: how many of all at least.

    among: families of its kind: what is said of one is said of any of so many
    """

    least: Array
    tests: float = 1.0
    among: float = 1.0

    @cached_property
    def independent(self) -> float:
        """How many independent tests the flips amount to."""
        median = float(np.exp(np.median(self.least)))
        return float(np.log(0.5) / np.log1p(-min(max(median, 1e-300), 0.999)))


@dataclass(frozen=True)
class Nulls:
    """What chance does to the blocks of each channel, those that lie between power-ons and those within them.

    least: (channel, whether between) -> (flips,); tests: of all channels together at least
    """

    least: Mapping[tuple[int, bool], Array]
    tests: float

    def of(self, axes: Iterable[int], between: bool) -> Null:
        """The family of a block of some channels: all of its kind that is tested on them."""
        kept = tuple(sorted(axis for axis in set(axes) if (axis, between) in self.least))
        if (kept, between) not in self.asked:
            least = np.min([self.least[axis, between] for axis in kept], axis=0)
            self.asked[kept, between] = Null(least, self.tests, len(self.least) / len(kept))
        return self.asked[kept, between]

    asked: dict[tuple[tuple[int, ...], bool], Null] = field(init=False, default_factory=dict, compare=False)


def family_wise(found: float, null: Null) -> float:
    """p over the whole family: by rank among the flips, and by the number of tests that they amount to.

    The larger of both: flips keep the residual's square and so have lighter tails than F with few degrees of
    freedom, and beyond the flips there is no rank.
    """
    by_number = max(null.among * null.independent, null.tests) * float(np.exp(max(found, -700.0)))
    beyond = int(np.sum(null.least <= found))
    by_rank = null.among * (1.0 + beyond) / (1.0 + len(null.least))
    return float(min(1.0, by_number if beyond == 0 else max(by_number, by_rank)))
