"""A channel of many rows as the means of stretches of them, row after row in each power-on, white again.

    z' = A z,   A Aᵀ = I   (a row of A is 1 / √m over the m rows of a stretch)

What changes more slowly than a stretch lasts keeps all that it explains, at a share of the rows; what changes
from row to row does not. A process that wanders for hours over 400 records of a power-on has a mode for each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.noise.channel_noise import ChannelNoise
from planner.diagnose.noise.whitened import Cleared
from planner.nouns.array import Array
from planner.solvers.group_batches import sums_of_groups


@dataclass(frozen=True)
class Stretches:
    """firsts: (m,) first row of every stretch; starts: (g,) first stretch of every power-on"""

    firsts: NDArray[np.int64]
    starts: NDArray[np.int64]
    rows: int

    @classmethod
    def of(cls, starts: NDArray[np.int64], rows: int, length: int) -> Stretches:
        """Of `length` rows each; the last one of a power-on may be shorter."""
        ends = np.append(starts[1:], rows)
        each = [np.arange(a, b, length) for a, b in zip(starts.tolist(), ends.tolist(), strict=True)]
        firsts = np.concatenate(each)
        return cls(firsts, np.searchsorted(firsts, starts), rows)

    @property
    def sizes(self) -> NDArray[np.int64]:
        """(m,) rows of each."""
        return np.diff(np.append(self.firsts, self.rows))

    def means(self, x: Array) -> Array:
        """(m,) of (n,)."""
        return np.asarray(np.add.reduceat(x, self.firsts) / self.sizes)

    def over_rows(self, columns: Array) -> Array:
        """(n, k) columns (m, k) of stretches, the same in every row of one."""
        return np.repeat(columns, self.sizes, axis=0)

    def white(self, columns: Array) -> Array:
        """(m, k) A times white columns (n, k)."""
        return sums_of_groups(columns, self.firsts) / np.sqrt(self.sizes)[:, None]


@dataclass(frozen=True)
class _Noise:
    noise: ChannelNoise
    stretches: Stretches

    def whiten(self, columns: Array) -> Array:
        """(m, k) of columns (n, k)."""
        return self.stretches.white(self.noise.whiten(columns))


@dataclass(frozen=True)
class Stretched:
    """A channel in stretches. Q: (m, q) declared model; z: (m,) residual clear of Q"""

    noise: _Noise
    Q: Array
    z: Array

    @classmethod
    def of(cls, w: Cleared, stretches: Stretches) -> Stretched:
        """The channel w: white noise of rows stays white noise of stretches."""
        Q = orthonormal(stretches.white(w.Q))
        z = clear(Q, stretches.white(w.z[:, None])[:, 0])
        return cls(_Noise(w.noise, stretches), Q, z)
