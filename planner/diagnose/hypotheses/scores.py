"""What blocks of a pool explain: Δ, its F test, a criterion by which unlike blocks compare, and its null.

For any set S of columns Δ_S = h_Sᵀ Gram_SS⁺ h_S is the drop of the residual's square (`pool`). Six products
of rates, of which one alone is there, hide it among five of noise: where a block's coefficients stand apart
each is looked at by itself as well, and what such a choice of m may find by chance is taken off,

    log p = log 2 + min(log p_S, log m + min_k log p_k),    among names C = max(C_S, max_k C_k − 2 log m)

(Bonferroni; Chen, Chen, Biometrika 95, 2008, 759: the extended Bayesian criterion). The null comes from the
same columns: the share of every segment in the residual of the full model, with random signs (Westfall,
Young: Resampling-Based Multiple Testing, 1993). Every channel has two families of its own, what lies between
power-ons and what changes within them, each one of so many: what wanders in one channel within its power-ons
makes its drifts larger than their F tests say, and by the smallest p of all no step would be significant.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.chance import Flips, Nulls, family_wise
from planner.diagnose.hypotheses.freedoms import satterthwaite
from planner.diagnose.hypotheses.pool import RANK, Contrast, Pool
from planner.diagnose.noise.whitened import log_p
from planner.nouns.array import Array

GRID = np.linspace(0.0, 1.0, 60) ** 2
OUT_OF_ACCURACY = 0.01  # of the references: off by more than is stated of them


@dataclass(frozen=True)
class Score:
    """What one block explains: Δ, columns m, freedom of its F test, s², log p of one test, and a criterion.

    criterion: Δ/s² − (m + parameters) log(effective number of rows), by which unlike blocks are compared;
        of a reference that the spec states, what its prior makes of it (`_with_prior`)
    among_names: the same of one coefficient where that is more, by which a name is chosen before others; to
        stand before bins over a variable, which say nothing of a form, a name answers for all it claims
    """

    delta: float
    m: int
    freedom: float
    s2: float
    log_p: float
    criterion: float
    among_names: float


NOTHING = Score(0.0, 0, 1.0, 1.0, 0.0, 0.0, 0.0)


def score(pool: Pool, chosen: Sequence[int]) -> Score:
    """The score of some blocks together."""
    c = contrast(pool, chosen)
    if c.m == 0:
        return NOTHING
    whole = _score(pool, chosen, c)
    single = _each_alone(pool, chosen[0]) if len(chosen) == 1 else ()
    if not single:
        return whole
    one = _score(pool, chosen, max(single, key=lambda s: _square(s.root, pool.h[s.k])))
    p = np.log(2.0) + min(whole.log_p, np.log(len(single)) + one.log_p)
    freedom = whole.freedom if whole.log_p <= one.log_p else one.freedom
    among = max(whole.criterion, one.criterion - 2.0 * float(np.log(len(single))))
    return replace(whole, log_p=float(min(p, 0.0)), freedom=freedom, among_names=among)


def _score(pool: Pool, chosen: Sequence[int], c: Contrast) -> Score:
    """The score of what a contrast of some blocks tests."""
    found = _square(c.root, pool.h[c.k])
    rows = max(c.freedom, 3.0)
    tail = float(log_p(found, c.m, c.freedom, c.s2))
    chosen_values = sum(len(pool.blocks[b].nonlinear) for b in chosen)
    criterion = found / c.s2 - (c.m + chosen_values) * np.log(rows)
    if len(chosen) == 1 and pool.blocks[chosen[0]].stated > 0.0:
        criterion = _with_prior(pool, c, pool.blocks[chosen[0]].stated, criterion)
    return Score(found, c.m, c.freedom, c.s2, tail, criterion, criterion)


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
        pool.asked[key] = _contrast(pool, chosen, pool.columns(chosen))
    return pool.asked[key]


def _contrast(pool: Pool, chosen: Sequence[int], k: NDArray[np.int64]) -> Contrast:
    """What some columns of some blocks test."""
    root, m = _root(pool.squares[k][:, None] if len(k) == 1 else pool.grams(k))
    if not m:
        return Contrast(k, root, 1.0, 1.0)
    if len(k) == 1:
        freedom = float(pool.freedoms[k[0]])
    else:
        freedom = satterthwaite(pool, _axes(pool, chosen), k, root / np.sqrt(m))
    return Contrast(k, root, freedom, mean_square(pool, chosen))


def _each_alone(pool: Pool, block: int) -> tuple[Contrast, ...]:
    """What each coefficient of a block tests that may be the only one there; none of a block of one."""
    if not pool.blocks[block].apart:
        return ()
    if block not in pool.alone:
        single = (_contrast(pool, [block], np.array([k])) for k in pool.places[block])
        pool.alone[block] = tuple(c for c in single if c.m)
    found = pool.alone[block]
    return found if len(found) > 1 else ()


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


def mean_square(pool: Pool, chosen: Sequence[int]) -> float:
    """Mean square of the remainder on the channels of some blocks: 1 when the noise model is right."""
    axes = _axes(pool, chosen)
    return max(sum(pool.state[a].mean_square for a in axes) / len(axes), 1e-3)


def _axes(pool: Pool, chosen: Sequence[int]) -> list[int]:
    return sorted({a for b in chosen for a in pool.blocks[b].columns})


# ---------------------------------------------------------------- chance


def nulls_of(pool: Pool, tested: Iterable[int], flips: Flips) -> Nulls:
    """The smallest log p over the tested blocks of every family in every flip."""
    tested = tuple(tested)
    for blocks, of, nulls in pool.nulls:
        if blocks == tested and of is flips:
            return nulls
    pool.nulls.append((tested, flips, _nulls_of(pool, tested, flips)))
    return pool.nulls[-1][-1]


def _nulls_of(pool: Pool, tested: Sequence[int], flips: Flips) -> Nulls:
    least = {(axis, kind): np.zeros(len(flips.signs)) for axis in pool.state for kind in (False, True)}
    looks: list[_Look] = []
    for b in tested:
        c = contrast(pool, [b])
        single = _each_alone(pool, b)
        for look in (c, *single) if c.m else ():
            many = 1.0 if not single else 2.0 * (1.0 if look is c else len(single))
            looks.append(_Look(b, look, float(np.log(many))))
    values = list(_flipped(pool, looks, flips.signs))
    for one, found in zip(looks, _log_p_of(looks, values), strict=True):
        for axis in pool.blocks[one.block].columns:
            family = least[axis, pool.between[one.block]]
            np.minimum(family, found, out=family)
    return Nulls(least, float(len({pool.blocks[b].key for b in tested})) if flips.few_runs else 1.0)


@dataclass(frozen=True)
class _Look:
    """A contrast of a block that is asked in every flip; many: log of how many of them the block had."""

    block: int
    c: Contrast
    many: float


def _flipped(pool: Pool, looks: Sequence[_Look], signs: Array) -> Iterator[Array]:
    """(f,) Δ of each contrast under random signs (f, g) of the segments."""
    every, t = pool.flipped(signs), pool.taken
    taken = np.concatenate([np.empty((0, len(signs))), *(every[b] for b in (t.blocks if t else ()))])
    for x in looks:
        k, R, first = x.c.k, x.c.root, pool.places[x.block][0]
        mine = every[x.block][k[0] - first : k[-1] - first + 1]  # one column of the block, or all
        if t is None:
            seen = R.T @ mine
        else:
            R = t.left[k][:, None] * R
            seen = R.T @ mine - (t.A[:, k] @ R).T @ taken
        yield np.einsum("mf,mf->f", seen, seen)


def chance_of(pool: Pool, block: int, s: Score, nulls: Nulls) -> float:
    """p of a block's score over the whole family; 1 of what explains nothing."""
    return family_wise(s.log_p, nulls.of(pool.blocks[block].columns, pool.between[block])) if s.m else 1.0


def _log_p_of(looks: Sequence[_Look], values: Sequence[Array]) -> Iterator[Array]:
    """(f,) log p of very many Δ (f,) of each contrast, by a table: they are counted."""
    if not looks:
        return
    largest = np.array([max(float(x.max(initial=0.0)), 1e-30) for x in values])
    m, freedom, s2, many = np.array([(x.c.m, x.c.freedom, x.c.s2, x.many) for x in looks]).T[:, :, None]
    grids = GRID * largest[:, None]
    tables = many + log_p(grids, m, freedom, s2)
    slopes, steps = np.diff(tables) / np.diff(grids), len(GRID) - 1
    for value, most, grid, table, slope in zip(values, largest, grids, tables, slopes, strict=True):
        # GRID = (i / steps)²: the place of a value in it is a root
        i = np.minimum((np.sqrt(value / most) * steps).astype(np.int64), steps - 1)
        yield table[i] + slope[i] * (value - grid[i])
