"""Every candidate's columns of one sensor, whitened and clear of the declared model, and what scores need.

    C = (I − QQᵀ) V^(−½) G stacked over the channels,   Gram = CᵀC,   h = Cᵀz

For any set S of columns Δ_S = h_Sᵀ Gram_SS⁺ h_S is the drop of the residual's square, and beside a set E that
was found already everything is the same after M = I − E Gram_EE⁺ Gram_E·. The null comes from the same
columns: the share of every segment in the residual of the full model, with random signs (Westfall, Young:
Resampling-Based Multiple Testing, 1993).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.orthogonal import clear
from planner.diagnose.hypotheses.shares import Segments, Shares
from planner.diagnose.hypotheses.whitened import SEEN, Whitened, log_p
from planner.nouns.array import Array

RANK = 1e-8  # of the largest eigenvalue: directions below are what is there already
MOST_CLEARED = 12  # pools beside others that are kept: a megabyte each
GRID = np.linspace(0.0, 1.0, 60) ** 2
OUT_OF_ACCURACY = 0.01  # of the references: off by more than is stated of them
APART = 1e-5  # of a column's square that must be left beside what was found


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
    """What a pool is clear of, M = I − E A. blocks, columns (e,): E; A: (e, K); left: (K,) where a rest is"""

    blocks: tuple[int, ...]
    columns: NDArray[np.int64]
    A: Array
    left: NDArray[np.bool_]


@dataclass(frozen=True)
class Pool:
    """state: axis -> channel; blocks, places: block -> its columns; axes: axis -> (k_a,) columns on it

    parts: axis -> (n, k_a) of length one over all axes; size: (K,) whitened length that they had, per SI unit
    gram: (K, K) of the parts; h: (K,) clear of what was taken; segments: for the flips; shares: of variances
    taken: what the pool is clear of, which never touches (K, K): a search asks for few blocks beside much
    asked, nulls, cleared: what was computed of it already: a search asks the same many times
    """

    state: Mapping[int, Whitened]
    blocks: tuple[Block, ...]
    places: tuple[NDArray[np.int64], ...]
    axes: Mapping[int, NDArray[np.int64]]
    parts: Mapping[int, Array]
    size: Array
    gram: Array
    h: Array
    segments: Segments
    shares: Mapping[int, Shares]
    taken: Taken | None = None
    asked: dict[tuple[int, ...], Contrast] = field(init=False, default_factory=dict, compare=False)
    nulls: list[tuple[tuple[int, ...], Flips, Null]] = field(init=False, default_factory=list, compare=False)
    cleared: dict[tuple[int, ...], Pool] = field(init=False, default_factory=dict, compare=False)

    def columns(self, chosen: Iterable[int]) -> NDArray[np.int64]:
        """The columns of some blocks."""
        found = [self.places[b] for b in chosen]
        return np.concatenate(found) if found else np.empty(0, dtype=np.int64)

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

    def flipped(self, signs: Array) -> Array:
        """(flips, K) sums of the segments under random signs, clear of what was taken."""
        H, t = self.segments.flipped(signs), self.taken
        return H if t is None else np.where(t.left, H - H[:, t.columns] @ t.A, 0.0)


def pool_of(state: Mapping[int, Whitened], blocks: Sequence[Block], cuts: NDArray[np.int64]) -> Pool:
    """The pool of some blocks; cuts: first row of every segment that keeps one sign under a flip."""
    counts = [next(iter(b.columns.values())).shape[1] for b in blocks]
    firsts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    places = tuple(np.arange(a, b) for a, b in pairwise(firsts))
    total = int(firsts[-1])
    axes: dict[int, NDArray[np.int64]] = {}
    parts: dict[int, Array] = {}
    before, after = np.zeros(total), np.zeros(total)
    for axis, w in state.items():
        mine = [i for i, b in enumerate(blocks) if axis in b.columns]
        n = len(w.z)
        raw = np.concatenate([np.empty((n, 0)), *(blocks[i].columns[axis] for i in mine)], axis=1)
        axes[axis] = np.concatenate([np.empty(0, dtype=np.int64), *(places[i] for i in mine)])
        white = w.noise.whiten(raw)
        parts[axis] = clear(w.Q, white)
        before[axes[axis]] += np.sum(white**2, axis=0)
        after[axes[axis]] += np.sum(parts[axis] ** 2, axis=0)
    size = np.sqrt(after)
    alive = after > SEEN**2 * before
    scale = np.where(alive, 1.0 / np.where(size > 0, size, 1.0), 0.0)
    for axis, part in parts.items():
        part *= scale[axes[axis]]  # in place: all candidates of a channel are a tenth of a gigabyte at most
    size = np.where(alive, size, 0.0)
    gram, h = np.zeros((total, total)), np.zeros(total)
    for axis, C in parts.items():
        gram[np.ix_(axes[axis], axes[axis])] += C.T @ C
        h[axes[axis]] += C.T @ state[axis].z
    of_axis = {a: tuple(i for i, b in enumerate(blocks) if a in b.columns) for a in state}
    return Pool(
        state,
        tuple(blocks),
        places,
        axes,
        parts,
        size,
        gram,
        h,
        Segments(parts, axes, {a: w.remainder for a, w in state.items()}, total, cuts),
        {a: Shares(state[a].noise, part, _places(of_axis[a], places)) for a, part in parts.items()},
    )


def _places(mine: Sequence[int], places: Sequence[NDArray[np.int64]]) -> dict[int, NDArray[np.int64]]:
    """Block -> its columns among those of one channel, whose blocks stand in their order."""
    firsts = np.cumsum([0, *(len(places[b]) for b in mine)])
    return {b: np.arange(firsts[i], firsts[i + 1]) for i, b in enumerate(mine)}


def extended(pool: Pool, block: Block, cuts: NDArray[np.int64]) -> Pool:
    """The pool with one more block at its end."""
    one, total, new = pool_of(pool.state, [block], cuts), len(pool.h), len(pool.blocks)
    axes = {a: np.concatenate([k, one.axes[a] + total]) for a, k in pool.axes.items()}
    parts = {a: np.concatenate([C, one.parts[a]], axis=1) for a, C in pool.parts.items()}
    size = np.concatenate([pool.size, one.size])
    gram = np.zeros((len(size), len(size)))
    gram[:total, :total], gram[total:, total:] = pool.gram, one.gram
    places, shares = (*pool.places, one.places[0] + total), {}
    for a, k in pool.axes.items():
        gram[np.ix_(k, one.axes[a] + total)] += pool.parts[a].T @ one.parts[a]
        mine = [*pool.shares[a].places, *([new] if a in block.columns else [])]
        shares[a] = Shares(pool.state[a].noise, parts[a], _places(mine, places))
    gram[total:, :total] = gram[:total, total:].T
    flips = pool.segments.flipped_with(one.segments)
    return replace(
        pool,
        blocks=(*pool.blocks, block),
        places=places,
        axes=axes,
        parts=parts,
        size=size,
        gram=gram,
        h=np.concatenate([pool.h, one.h]),
        segments=Segments(parts, axes, pool.segments.remainder, len(size), cuts, flips),
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
    A = inverse(pool.gram[np.ix_(e, e)]) @ pool.gram[e, :]
    square = np.maximum(np.diag(pool.gram), 1e-300)
    left = square - np.einsum("ek,ek->k", pool.gram[e, :], A) > APART * square
    left[e] = False
    h = np.where(left, pool.h - pool.h[e] @ A, 0.0)
    return replace(pool, h=h, taken=Taken(tuple(found), e, A, left))


def inverse(G: Array) -> Array:
    """G⁺ (k, k) of a Gram matrix: directions of less than RANK of the largest tell nothing."""
    return np.asarray(np.linalg.pinv(G, rcond=RANK, hermitian=True), dtype=float)


@dataclass(frozen=True)
class Score:
    """What one block explains: Δ, columns m, freedom of its F test, s², log p of one test, and a criterion.

    criterion: Δ/s² − (m + parameters) log(effective number of rows), by which unlike blocks are compared;
        of a reference that the spec states, what its prior makes of it (`_with_prior`)
    """

    delta: float
    m: int
    freedom: float
    s2: float
    log_p: float
    criterion: float


NOTHING = Score(0.0, 0, 1.0, 1.0, 0.0, 0.0)


def score(pool: Pool, chosen: Sequence[int]) -> Score:
    """The score of some blocks together."""
    c = contrast(pool, chosen)
    if c.m == 0:
        return NOTHING
    found = _square(c.root, pool.h[c.k])
    rows = max(c.freedom, 3.0)
    tail = float(log_p(found, c.m, c.freedom, c.s2))
    chosen_values = sum(len(pool.blocks[b].nonlinear) for b in chosen)
    criterion = found / c.s2 - (c.m + chosen_values) * np.log(rows)
    if len(chosen) == 1 and pool.blocks[chosen[0]].stated > 0.0:
        criterion = _with_prior(pool, c, pool.blocks[chosen[0]].stated, criterion)
    return Score(found, c.m, c.freedom, c.s2, tail, criterion)


def _with_prior(pool: Pool, c: Contrast, stated: float, criterion: float) -> float:
    """The criterion of a reference error of which one sigma is stated beforehand.

    Within that, twice the log Bayes factor of γ ~ N(0, σ²) against none, with no more of Occam's factor than
    a coefficient pays of which nothing is stated; or else the bench is out of its accuracy, one in a hundred:

        bᵀ L⁻¹ b − log det L,    b = σ h / s²,  L = I + σ Gram σ / s²
    """
    a = stated * pool.size[c.k]
    b = a * pool.h[c.k] / c.s2
    L = np.eye(len(a)) + a[:, None] * pool.grams(c.k) * a / c.s2
    occam = min(np.linalg.slogdet(L)[1], c.m * np.log(max(c.freedom, 3.0)))
    within = float(b @ np.linalg.solve(L, b) - occam)
    return max(within, criterion + 2.0 * float(np.log(OUT_OF_ACCURACY)))


def contrast(pool: Pool, chosen: Sequence[int]) -> Contrast:
    """What some blocks test together, computed once."""
    key = tuple(chosen)
    if key not in pool.asked:
        k = pool.columns(chosen)
        root, m = _root(pool.grams(k))
        freedom, s2 = 1.0, 1.0
        if m:
            axes = _axes(pool, chosen)
            freedom = satterthwaite(pool, axes, pool.beside(k, root / np.sqrt(m)))
            s2 = mean_square(pool, chosen)
        pool.asked[key] = Contrast(k, root, freedom, s2)
    return pool.asked[key]


def delta(pool: Pool, chosen: Sequence[int]) -> float:
    """Δ of some blocks together."""
    k = pool.columns(chosen)
    return _square(_root(pool.grams(k))[0], pool.h[k])


def _square(root: Array, h: Array) -> float:
    return float(np.sum((root.T @ h) ** 2))


def _root(G: Array) -> tuple[Array, int]:
    """R (k, m) with R Rᵀ = G⁺."""
    if G.shape[0] == 1:
        return (np.array([[1.0 / np.sqrt(G[0, 0])]]), 1) if G[0, 0] > 0 else (np.zeros((1, 0)), 0)
    values, vectors = np.linalg.eigh(G)
    kept = values > max(RANK * max(values[-1], 0.0), 1e-14) if len(values) else np.zeros(0, dtype=bool)
    return vectors[:, kept] / np.sqrt(values[kept]), int(kept.sum())


def satterthwaite(pool: Pool, axes: Iterable[int], R: Array) -> float:
    """2 / relative variance of what REML says of the variance of contrasts R (K, m) with Σ Rᵀ Gram R = 1.

    The columns' variance is made of those of white noise, of runs, …, each known as well as REML knows it.
    """
    spread = 0.0
    for axis in axes:
        mine = R[pool.axes[axis]]
        some = np.flatnonzero(mine.any(axis=1))
        if not len(some):
            continue
        stand = () if pool.taken is None else pool.taken.blocks
        A = pool.shares[axis].of(some, [b for b in stand if axis in pool.blocks[b].columns])
        mine = mine[some]
        share = np.einsum("sm,ksm->k", mine, A @ mine)
        spread += float(share @ pool.state[axis].noise.relative_error @ share)
    return min(max(2.0 / max(spread, 1e-12), 1.0), 1e6)


def mean_square(pool: Pool, chosen: Sequence[int]) -> float:
    """Mean square of the remainder on the channels of some blocks: 1 when the noise model is right."""
    axes = _axes(pool, chosen)
    return max(sum(pool.state[a].mean_square for a in axes) / len(axes), 1e-3)


def _axes(pool: Pool, chosen: Sequence[int]) -> list[int]:
    return sorted({a for b in chosen for a in pool.blocks[b].columns})


# ---------------------------------------------------------------- chance


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
    """What chance does. least: (flips,) smallest log p over the family; tests: how many at least."""

    least: Array
    tests: float = 1.0

    @cached_property
    def independent(self) -> float:
        """How many independent tests the flips amount to."""
        median = float(np.exp(np.median(self.least)))
        return float(np.log(0.5) / np.log1p(-min(max(median, 1e-300), 0.999)))


def null_of(pool: Pool, tested: Iterable[int], flips: Flips) -> Null:
    """The smallest log p over the tested blocks in every flip."""
    tested = tuple(tested)
    for blocks, of, null in pool.nulls:
        if blocks == tested and of is flips:
            return null
    pool.nulls.append((tested, flips, _null_of(pool, tested, flips)))
    return pool.nulls[-1][-1]


def _null_of(pool: Pool, tested: Sequence[int], flips: Flips) -> Null:
    H = pool.flipped(flips.signs)
    least = np.zeros(len(flips.signs))
    for b in tested:
        c = contrast(pool, [b])
        if c.m:
            seen = H[:, c.k] @ c.root
            _lower(least, np.einsum("fm,fm->f", seen, seen), c)
    return Null(least, float(len({pool.blocks[b].key for b in tested})) if flips.few_runs else 1.0)


def _lower(least: Array, values: Array, c: Contrast) -> None:
    """`least` down to log p of very many Δ of a contrast, from a table: they only count which are rarer.

    Below the largest Δ of the table that is no rarer than any of them already is, nothing is to be looked up.
    """
    grid = GRID * float(values.max(initial=0.0))
    if grid[-1] <= 0.0:
        return
    table = log_p(grid, c.m, c.freedom, c.s2)
    rare = values > grid[table >= least.max()][-1]  # of Δ = 0 log p is 0, and no smaller one is larger
    least[rare] = np.minimum(least[rare], np.interp(values[rare], grid, table))


def family_wise(found: float, null: Null) -> float:
    """p over the whole family: by rank among the flips, and by the number of tests that they amount to.

    The larger of both: flips keep the residual's square and so have lighter tails than F with few degrees of
    freedom, and beyond the flips there is no rank.
    """
    by_number = min(1.0, max(null.independent, null.tests) * float(np.exp(max(found, -700.0))))
    beyond = int(np.sum(null.least <= found))
    return float(by_number if beyond == 0 else max(by_number, (1.0 + beyond) / (1.0 + len(null.least))))
