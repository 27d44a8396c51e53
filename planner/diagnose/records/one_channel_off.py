"""A power-on in which one channel is off by itself: a sign lost, two axes swapped, a table at another rate.

The noise model takes it for the spread of the channel's scale factor and nothing is significant beside that,
or a name that follows this one power-on is refused, and nothing is said. Here the other power-ons say what it
should have read, about the mean of each, under all that is declared and believed. Leaving it out changes the
residual's square by

    Δ_q = e_qᵀ (I − H_qq)⁺ e_q,   H = X (XᵀX)⁺ Xᵀ,  e = y − H y

in units of what drives the noise of each row, as the others tell it (Cook, Weisberg, Residuals and Influence
in Regression, 1982). One that is off by five times as much as any other is no draw of a spread. Where two
alone share a condition either may be off, and both are named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.noise.channel_noise import plain_spread
from planner.diagnose.noise.far_rows import drawn
from planner.diagnose.noise.outliers import FAR_WEIGHT
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array

FARTHER = 25.0  # times the mean square of any other power-on: five sigma of the worst of them
AT_FIRST_SIGHT = 4.0  # times the others' mean, while it may itself have widened the noise that judges it
EITHER = 1.5  # times the least that is left without one: without another one hardly more is left
MOST = 2  # power-ons of which either may be off; among more nobody knows which
TRIED = 12  # power-ons of which most is left for what the fit left free
SEVERAL = 3  # rows that are each farther than any of the others: fewer are accidents of rows
SEEN = 1e-6  # of a column's length about the means of power-ons, below which it is nothing
RANK = 1e-10  # of the largest eigenvalue of XᵀX
FREE = 0.1  # of a direction, that is left of it beside its own fit: of less the others hardly say what it is


@dataclass(frozen=True)
class _Channel:
    """X: (n, k) columns and y: (n,) reading about the means of power-ons, in each row's sigma; far rows 0

    scatter: (n,) sigma by which the spec lets a reading be off with its whole power-on, in the same unit
    level: (n,) what one bias of a power-on is in it, 0 of far rows
    """

    X: Array
    y: Array
    starts: NDArray[np.int64]
    scatter: Array
    level: Array

    @cached_property
    def parts(self) -> list[slice]:
        """Rows of every power-on."""
        ends = np.append(self.starts[1:], len(self.y))
        return [slice(int(a), int(b)) for a, b in zip(self.starts, ends, strict=True)]

    @cached_property
    def basis(self) -> Array:
        """(n, r) orthonormal, of the columns."""
        value, vector = np.linalg.eigh(self.X.T @ self.X)
        kept = value > RANK * max(float(value.max(initial=0.0)), 1e-300)
        return np.asarray(self.X @ (vector[:, kept] / np.sqrt(value[kept])))

    @cached_property
    def left(self) -> Array:
        """(n,) what the columns leave."""
        return np.asarray(self.y - self.basis @ (self.basis.T @ self.y))

    def off(self, place: int) -> tuple[Array, Array]:
        """(m,) what a power-on is off by where the others say what it reads, 0 where not; (m,) its sigma."""
        Q, e = self.basis[self.parts[place]], self.left[self.parts[place]]
        value, vector = np.linalg.eigh(np.eye(len(Q)) - Q @ Q.T)
        free = value > FREE
        along = vector[:, free]
        return along @ ((along.T @ e) / value[free]), np.sqrt(np.sum(along**2 / value[free], axis=1))

    def drops(self, told: NDArray[np.bool_]) -> Array:
        """(g,) Δ of leaving out each power-on; 0 of those that are not told, or of which little is left."""
        sizes = np.diff(np.append(self.starts, len(self.y)))
        free = sizes - np.add.reduceat(np.sum(self.basis**2, axis=1), self.starts)
        usual = np.add.reduceat(self.left**2, self.starts) / np.maximum(free, FREE)
        out = np.zeros(len(told))
        for place in np.argsort(-np.where(told, usual, 0.0))[:TRIED].tolist():
            if told[place]:
                out[place] = float(self.off(place)[0] @ self.left[self.parts[place]])
        return out

    def without(self, place: int) -> Array:
        """(n,) what is left of the others without a power-on, 0 in it."""
        out = np.asarray(self.left + self.basis @ (self.basis[self.parts[place]].T @ self.off(place)[0]))
        out[self.parts[place]] = 0.0
        return out


def alone(
    found: Sequence[SensorFound], data: Prepared, told: NDArray[np.bool_]
) -> tuple[list[int], list[str]]:
    """The place of the power-on that is off on some channels alone, of two where either may be, and these.

    Nothing where the channels do not agree on it. told: (g,) power-ons whose records others repeat
    """
    places: set[int] = set()
    channels: list[str] = []
    for s in found:
        for c in s.channels:
            mine = _off(s, c.axis, data, told)
            if mine and channels and not places & mine:
                return [], []
            if mine:
                places = places & mine if channels else mine
                channels.append(c.name)
    return sorted(places), channels


def _off(s: SensorFound, axis: int, data: Prepared, told: NDArray[np.bool_]) -> set[int]:
    """Places of the power-ons of which one is off by itself; none where no one stands out."""
    w = s.found.pool.state[axis]
    c = _channel(s, axis, data, w.noise.spread)
    drops = c.drops(told)
    place = int(np.argmax(drops))
    rest, mine = float(c.left @ c.left) - drops[place], c.parts[place]
    rows = mine.stop - mine.start
    if drops[place] * (len(c.y) - rows) <= AT_FIRST_SIGHT * rest * rows:
        return set()
    weights = np.where(s.far[axis], FAR_WEIGHT, 1.0)
    weights[mine] = FAR_WEIGHT
    spread = plain_spread(w.channel, data.starts, data.table.duration, weights) * np.sqrt(weights)
    c = _channel(s, axis, data, spread)
    drops = c.drops(told)
    left = float(c.left @ c.left) - drops
    either = np.flatnonzero(told & (left <= EITHER * left.min()))
    return set(either.tolist()) if len(either) <= MOST and _stands_out(c, int(np.argmax(drops))) else set()


def _stands_out(c: _Channel, place: int) -> bool:
    """Whether a power-on is off by so many times as much as any other, in several rows beyond its spreads.

    A scale factor that is drawn anew at every power-on is as far off in one of three pairs now and then. One
    spike is off from the mean of its power-on, and with it all the others are: the middle row is where it is.
    """
    mine, others = c.parts[place], c.without(place) ** 2
    off, sigma = c.off(place)
    drop = float(off @ c.left[mine])
    level, seen = c.level[mine], c.level[mine] > 0.0
    off = off - level * np.median(off[seen] / level[seen]) if seen.any() else off
    sizes = np.diff(np.append(c.starts, len(others)))
    usual = np.add.reduceat(others, c.starts) / np.maximum(sizes - 1, 1)
    beyond = np.abs(off) > np.sqrt(FARTHER) * np.hypot(sigma, np.sqrt(2.0) * c.scatter[mine])
    several = np.count_nonzero(beyond & (off**2 > others.max() * sigma**2)) >= SEVERAL
    return bool(several and drop > FARTHER * max(float(usual.max()), 1.0) * max(len(off) - 1, 1))


def _channel(s: SensorFound, axis: int, data: Prepared, spread: Array) -> _Channel:
    w, pool = s.found.pool.state[axis], s.found.pool
    believed = [pool.blocks[b].columns[axis] for b in s.found.all if axis in pool.blocks[b].columns]
    A = np.column_stack([w.channel.J, *believed, w.channel.r]) / spread[:, None]
    seen, sizes = ~s.far[axis], np.diff(np.append(data.starts, len(A)))
    level = (seen / spread)[:, None]  # of a power-on, in each row's sigma: records last unequally long
    weight = np.maximum(np.add.reduceat(level**2, data.starts), 1e-300)
    means = np.add.reduceat(A * level, data.starts) / weight
    about = A * seen[:, None] - np.repeat(means, sizes, axis=0) * level
    length = np.linalg.norm(about, axis=0)
    kept = length[:-1] > SEEN * np.linalg.norm(A[:, :-1], axis=0)
    scatter = np.linalg.norm(drawn(data.unit, w.channel), axis=1) / spread
    columns = about[:, :-1][:, kept] / length[:-1][kept]
    return _Channel(columns, about[:, -1], data.starts, scatter, level[:, 0])
