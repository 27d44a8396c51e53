"""Every candidate's columns of one sensor, whitened and clear of the declared model, and what scores need.

    C = (I − QQᵀ) V^(−½) G stacked over the channels,   Gram = CᵀC,   h = Cᵀz

For any set S of columns Δ_S = h_Sᵀ Gram_SS⁺ h_S is the drop of the residual's square (`scores`), and beside a
set E that was found already everything is the same after M = I − E Gram_EE⁺ Gram_E·.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.chance import Flips, Nulls
from planner.diagnose.hypotheses.freedoms import of_each_column
from planner.diagnose.noise.shares import Shares
from planner.diagnose.noise.whitened import SEEN, Cleared, Whitened, of_means
from planner.nouns.array import Array
from planner.solvers.group_batches import sums_of_groups

RANK = 1e-8  # of the largest eigenvalue: directions below are what is there already
MOST_CLEARED = 12  # pools beside others that are kept: a megabyte each
APART = 1e-5  # of a column's square that must be left beside what was found
# of a column's length that must be left where an effect that is strong leans the input, by a part in a
# thousand: on six faces a cube of it is the input itself but for that part, the effect over again
BESIDE_STRONG = 5e-3


@dataclass(frozen=True)
class Contrast:
    """What some blocks test. k: columns; root: (k, m), R Rᵀ = Gram⁺; freedom, s2: of their variance."""

    k: NDArray[np.int64]
    root: Array
    freedom: float
    s2: float

    @property
    def m(self) -> int:
        """How many directions."""
        return int(self.root.shape[1])


@dataclass(frozen=True)
class Taken:
    """What a pool is clear of, M = I − E A. blocks, columns (e,): E; A: (e, K); left: (K,) where a rest is

    sizes: (e,) coefficients of E by themselves, Gram_EE⁺ h_E
    """

    blocks: tuple[int, ...]
    columns: NDArray[np.int64]
    A: Array
    left: NDArray[np.bool_]
    sizes: Array


@dataclass(frozen=True)
class Pool:
    """state: axis -> channel; blocks, places: block -> its columns; axes: axis -> (k_a,) columns on it

    parts: axis -> (n, k_a) of length one over all axes; size: (K,) whitened length that they had, per SI unit
    between: block -> whether most of it lies between power-ons, not within them
    gram: (K, K) of the parts; h: (K,) clear of what was taken; shares: of variances
    cuts: (g,) first row of every segment that keeps one sign under a flip
    segments: (g, K) what each of these has of the parts' product with the residual of the full model
    taken: what the pool is clear of, which never touches (K, K): a search asks for few blocks beside much
    flips: signs with what they made of every block, kept
    asked, alone, nulls, cleared: what was computed of it already: a search asks the same many times
    """

    state: Mapping[int, Whitened]
    blocks: tuple[Block, ...]
    places: tuple[NDArray[np.int64], ...]
    axes: Mapping[int, NDArray[np.int64]]
    parts: Mapping[int, Array]
    size: Array
    between: tuple[bool, ...]
    gram: Array
    h: Array
    cuts: NDArray[np.int64]
    segments: Array
    shares: Mapping[int, Shares]
    taken: Taken | None = None
    flips: list[tuple[Array, list[Array]]] = field(default_factory=list, compare=False)
    asked: dict[tuple[int, ...], Contrast] = field(init=False, default_factory=dict, compare=False)
    alone: dict[int, tuple[Contrast, ...]] = field(init=False, default_factory=dict, compare=False)
    nulls: list[tuple[tuple[int, ...], Flips, Nulls]] = field(init=False, default_factory=list, compare=False)
    cleared: dict[tuple[int, ...], Pool] = field(init=False, default_factory=dict, compare=False)

    def columns(self, chosen: Iterable[int]) -> NDArray[np.int64]:
        """The columns of some blocks."""
        found = [self.places[b] for b in chosen]
        return np.concatenate(found) if found else np.empty(0, dtype=np.int64)

    @cached_property
    def squares(self) -> Array:
        """(K,) what is left of every column, squared, clear of what was taken."""
        square, t = np.diag(self.gram), self.taken
        if t is None:
            return square
        return np.where(t.left, square - np.einsum("ek,ek->k", self.gram[t.columns], t.A), 0.0)

    @cached_property
    def freedoms(self) -> Array:
        """(K,) of what every column tests by itself."""
        return of_each_column(self)

    def grams(self, k: NDArray[np.int64]) -> Array:
        """(k, k) Gram matrix of some columns, clear of what was taken."""
        G, t = self.gram[k[:, None], k], self.taken
        if t is None:
            return np.asarray(G)
        left = t.left[k]
        rest = G - self.gram[k[:, None], t.columns] @ t.A[:, k]
        return np.where(left[:, None] & left, rest, 0.0)

    def beside(self, k: NDArray[np.int64], R: Array) -> Array:
        """(K, m) M_k R, what contrasts R (k, m) of some columns are of the parts."""
        out, t = np.zeros((len(self.h), R.shape[1])), self.taken
        if t is None:
            out[k] = R
            return out
        out[k] = t.left[k][:, None] * R
        out[t.columns] -= t.A[:, k] @ out[k]
        return out

    def seen(self, axis: int, k: NDArray[np.int64]) -> Array:
        """(n, k) some columns on one channel, clear of what was taken."""
        M = self.beside(k, np.eye(len(k)))[self.axes[axis]]
        some = M.any(axis=1)
        return np.asarray(self.parts[axis][:, some] @ M[some])

    def remainder(self, axis: int) -> Array:
        """(n,) z of one channel, clear of what was taken.

        Columns that are clear of it see nothing of it in all rows together, and all of it in some of them.
        """
        z, t = self.state[axis].z, self.taken
        if t is None:
            return z
        mine = np.isin(self.axes[axis], t.columns)
        return z - self.parts[axis][:, mine] @ t.sizes[np.searchsorted(t.columns, self.axes[axis][mine])]

    def flipped(self, signs: Array) -> list[Array]:
        """(k, f) of every block, sums of `segments` under random signs (f, g), of the parts as they are."""
        for known, sums in self.flips:
            if known is signs:
                return sums
        every = self.segments.T @ signs.T  # by columns, of which few are asked at once
        ends = np.cumsum([len(k) for k in self.places])
        self.flips.append((signs, np.split(every, ends[:-1])))
        return self.flips[-1][1]


def pool_of(
    state: Mapping[int, Whitened],
    blocks: Sequence[Block],
    cuts: NDArray[np.int64],
    known: Mapping[int, Cleared] | None = None,
) -> Pool:
    """The pool of some blocks; cuts: first row of every segment that keeps one sign under a flip.

    known: their columns by channel, where they are whitened already: what is left of them becomes the pool's
    """
    counts = [next(iter(b.columns.values())).shape[1] for b in blocks]
    firsts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    places = tuple(np.arange(a, b) for a, b in pairwise(firsts))
    total = int(firsts[-1])
    axes: dict[int, NDArray[np.int64]] = {}
    parts: dict[int, Array] = {}
    before, after = np.zeros(total), np.zeros(total)
    for axis, w in state.items():
        mine = [i for i, b in enumerate(blocks) if axis in b.columns]
        axes[axis] = np.concatenate([np.empty(0, dtype=np.int64), *(places[i] for i in mine)])
        here = known[axis] if known else w.clear_of_declared([blocks[i].columns[axis] for i in mine])
        parts[axis] = here.left
        before[axes[axis]] += here.lengths
        after[axes[axis]] += np.einsum("nk,nk->k", parts[axis], parts[axis])
    size = np.sqrt(after)
    strong = {name for w in state.values() for name in w.channel.found}
    least = np.full(total, BESIDE_STRONG if strong else SEEN)
    for b, place in zip(blocks, places, strict=True):
        if b.name in strong:
            least[place] = SEEN
    alive = after > least**2 * before
    scale = np.where(alive, 1.0 / np.where(size > 0, size, 1.0), 0.0)
    for axis, part in parts.items():
        part *= scale[axes[axis]]  # in place: all candidates of a channel are a tenth of a gigabyte at most
    size = np.where(alive, size, 0.0)
    gram, h, of_segments = np.zeros((total, total)), np.zeros(total), np.zeros((len(cuts), total))
    for axis, C in parts.items():
        gram[np.ix_(axes[axis], axes[axis])] += C.T @ C
        h[axes[axis]] += C.T @ state[axis].z
        of_segments[:, axes[axis]] += sums_of_groups(C, cuts, state[axis].remainder)
    of_axis = {a: tuple(i for i, b in enumerate(blocks) if a in b.columns) for a in state}
    return Pool(
        state,
        tuple(blocks),
        places,
        axes,
        parts,
        size,
        _lie_between(state, places, axes, parts),
        gram,
        h,
        cuts,
        of_segments,
        {a: Shares(state[a].noise, part, _places(of_axis[a], places)) for a, part in parts.items()},
    )


def _lie_between(
    state: Mapping[int, Whitened],
    places: Sequence[NDArray[np.int64]],
    axes: Mapping[int, NDArray[np.int64]],
    parts: Mapping[int, Array],
) -> tuple[bool, ...]:
    """Of every block whether the means of power-ons hold half of its columns' squares."""
    means, every = np.zeros(sum(map(len, places))), np.zeros(sum(map(len, places)))
    for axis, C in parts.items():
        means[axes[axis]] += np.sum(of_means(C, state[axis].noise.starts) ** 2, axis=0)
        every[axes[axis]] += np.einsum("nk,nk->k", C, C)
    return tuple(bool(means[k].sum() > 0.5 * every[k].sum()) for k in places)


def _places(mine: Sequence[int], places: Sequence[NDArray[np.int64]]) -> dict[int, NDArray[np.int64]]:
    """Block -> its columns among those of one channel, whose blocks stand in their order."""
    firsts = np.cumsum([0, *(len(places[b]) for b in mine)])
    return {b: np.arange(firsts[i], firsts[i + 1]) for i, b in enumerate(mine)}


def extended(pool: Pool, block: Block, cuts: NDArray[np.int64]) -> Pool:
    """The pool with one more block at its end."""
    one, total, new = pool_of(pool.state, [block], cuts), len(pool.h), len(pool.blocks)
    axes, parts, shares = dict(pool.axes), dict(pool.parts), dict(pool.shares)
    size = np.concatenate([pool.size, one.size])
    gram = np.zeros((len(size), len(size)))
    gram[:total, :total], gram[total:, total:] = pool.gram, one.gram
    for a in block.columns:
        k = pool.axes[a]
        axes[a] = np.concatenate([k, one.axes[a] + total])
        parts[a] = np.concatenate([pool.parts[a], one.parts[a]], axis=1)
        shares[a] = pool.shares[a].with_block(new, parts[a])
        gram[np.ix_(k, one.axes[a] + total)] += pool.parts[a].T @ one.parts[a]
    gram[total:, :total] = gram[:total, total:].T
    return replace(
        pool,
        blocks=(*pool.blocks, block),
        places=(*pool.places, one.places[0] + total),
        axes=axes,
        parts=parts,
        size=size,
        between=(*pool.between, *one.between),
        gram=gram,
        h=np.concatenate([pool.h, one.h]),
        segments=np.concatenate([pool.segments, one.segments], axis=1),
        flips=[(signs, [*sums, *one.flipped(signs)]) for signs, sums in pool.flips],
        shares=shares,
        taken=None,
    )


# ---------------------------------------------------------------- beside what was found


def given(pool: Pool, found: Iterable[int]) -> Pool:
    """The pool clear of some of its blocks (their own columns become nothing)."""
    key = tuple(sorted(found))
    if len(pool.columns(key)) == 0:
        return pool  # not kept in itself: with all its arrays it would outlive the diagnosis
    if key not in pool.cleared:
        while len(pool.cleared) >= MOST_CLEARED:
            pool.cleared.pop(next(iter(pool.cleared)))
        pool.cleared[key] = _given(pool, key)
    return pool.cleared[key]


def _given(pool: Pool, found: Sequence[int]) -> Pool:
    assert pool.taken is None  # all that is believed is taken at once
    e = pool.columns(found)
    known = inverse(pool.gram[np.ix_(e, e)])
    A = known @ pool.gram[e, :]
    square = np.maximum(np.diag(pool.gram), 1e-300)
    left = square - np.einsum("ek,ek->k", pool.gram[e, :], A) > APART * square
    left[e] = False
    h = np.where(left, pool.h - pool.h[e] @ A, 0.0)
    return replace(pool, h=h, taken=Taken(tuple(found), e, A, left, known @ pool.h[e]))


def inverse(G: Array) -> Array:
    """G⁺ (…, k, k) of Gram matrices: directions of less than RANK of the largest tell nothing."""
    return np.asarray(np.linalg.pinv(G, rcond=RANK, hermitian=True), dtype=float)
