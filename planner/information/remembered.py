"""What campaigns were found to leave, and their figures, kept: a search comes back to half of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

MOST = 40_000  # campaigns under one family each: some 100 MB of six requirements, seldom reached

Left = tuple[list[Array], NDArray[np.bool_]]


@dataclass
class Remembered:
    """Per campaign and family: covariances of every requirement, whether what flies is undetermined; figures.

    figured: (requirements,) each
    """

    known: dict[tuple[bytes, int], tuple[tuple[Array, ...], bool]] = field(default_factory=dict)
    figured: dict[tuple[bytes, int], Array] = field(default_factory=dict)

    def figures(
        self,
        counts: Array,
        families: Sequence[int],
        leaves: Callable[[Array, Sequence[int]], Left],
        figures_of: Callable[[Left], Array],
    ) -> Array:
        """(B, families, requirements) as `figures_of` says of what counts (B, g) leave."""
        keys = _keys(counts)
        if len(self.figured) + len(keys) * len(families) > MOST:
            self.figured.clear()
        new = {k: b for b, k in enumerate(keys) if any((k, f) not in self.figured for f in families)}
        if new:
            found = figures_of(self.left(counts[[*new.values()]], families, leaves))
            for key, each in zip(new, found, strict=True):
                self.figured |= {(key, f): one for f, one in zip(families, each, strict=True)}
        return np.array([[self.figured[k, f] for f in families] for k in keys])

    def left(
        self, counts: Array, families: Sequence[int], leaves: Callable[[Array, Sequence[int]], Left]
    ) -> Left:
        """As `leaves` says of counts (B, g) under families, asked only for what is not known yet."""
        keys = _keys(counts)
        if len(self.known) + len(keys) * len(families) > MOST:
            self.known.clear()
        new = {k: b for b, k in enumerate(keys) if any((k, f) not in self.known for f in families)}
        if len(new) == len(keys) > 1:
            return self._learn(keys, families, leaves(counts, families))
        if new:
            self._learn([*new], families, leaves(counts[[*new.values()]], families))
        found = [[self.known[k, f] for f in families] for k in keys]
        requirements = range(len(found[0][0][0]))
        each = [np.array([[one[0][r] for one in row] for row in found]) for r in requirements]
        return each, np.array([row[0][1] for row in found])

    def _learn(self, keys: Sequence[bytes], families: Sequence[int], left: Left) -> Left:
        covariances, undetermined = left
        for b, key in enumerate(keys):
            for i, family in enumerate(families):
                self.known[key, family] = tuple(S[b, i] for S in covariances), bool(undetermined[b])
        return left


def _keys(counts: Array) -> list[bytes]:
    """Equal for equal campaigns (B, g)."""
    return [n.tobytes() for n in np.ascontiguousarray(counts, dtype=float)]
