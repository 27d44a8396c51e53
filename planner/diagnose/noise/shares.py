"""What each variance of a channel's noise gives to the covariance of its candidates' columns.

    A_k = θ_k Cᵀ W V_k Wᵀ C,   Σ_k A_k = CᵀC,   C (n, q) whitened columns, W V Wᵀ = I

A test of one block asks for a few of these columns only: its own, and those of what stands beside it. So they
are made block by block, and a row of blocks when one of them is believed, θ_k (W V_k Wᵀ C_b)ᵀ C.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.noise.channel_noise import ChannelNoise
from planner.nouns.array import Array


@dataclass(frozen=True)
class Shares:
    """One channel's. columns: (n, q) C; places: block -> its columns among these

    known: block -> (K, k, k) of the first blocks, where it was made already
    rows: block -> (K, k, q) of a block that was asked for beside others
    """

    noise: ChannelNoise
    columns: Array
    places: Mapping[int, NDArray[np.int64]]
    known: Mapping[int, Array] = field(default_factory=dict, compare=False)
    rows: dict[int, Array] = field(init=False, default_factory=dict, compare=False)

    def of_contrasts(self, some: NDArray[np.int64], R: Array, stand: Mapping[int, Array]) -> Array:
        """(K,) tr RᵀA_kR of contrasts that are R (s, m) of some columns (s,), and (k, m) of those that stand.

        stand: by blocks, which will be asked for again and again

            tr RᵀA_kR = tr R_sᵀA_ssR_s + Σ_b tr R_bᵀ (2 A_bs R_s + Σ_c A_bc R_c)
        """
        share = np.einsum("sm,ksm->k", R, self.of(some) @ R)
        for b, mine in stand.items():
            row = self._row(b)
            met = row[:, :, some] @ (2.0 * R)
            for c, other in stand.items():
                met += row[:, :, self.places[c][0] : self.places[c][-1] + 1] @ other
            share += np.einsum("sm,ksm->k", mine, met)
        return np.asarray(share)

    def of_each(self, R: Array, stand: Mapping[int, Array]) -> Array:
        """(K, q) the same of every column by itself, R (q,) times it; stand: block -> (k, q)."""
        share = self._squares * R**2
        for b, mine in stand.items():
            row = self._row(b)
            met = row * (2.0 * R)
            for c, other in stand.items():
                met += row[:, :, self.places[c][0] : self.places[c][-1] + 1] @ other
            share += np.einsum("sq,ksq->kq", mine, met)
        return np.asarray(share)

    def of(self, some: NDArray[np.int64]) -> Array:
        """(K, s, s) of some columns (s,)."""
        asked = sorted(set(self._block[some].tolist()), key=lambda b: b in self.rows)
        if len(asked) == 1:
            own, at = self._own[asked[0]], some - self.places[asked[0]][0]
            whole = len(at) == own.shape[1] and bool((at == np.arange(len(at))).all())
            return own if whole else np.asarray(own[:, at[:, None], at])
        out = np.empty((len(self.noise.components), len(some), len(some)))
        before = np.empty(0, dtype=np.int64)
        for b in asked:
            mine = np.flatnonzero(self._block[some] == b)
            at = some[mine] - self.places[b][0]
            out[:, mine[:, None], mine] = self._own[b][:, at[:, None], at]
            if len(before):
                row = self._row(b)[:, at[:, None], some[before]]
                out[:, mine[:, None], before] = row
                out[:, before[:, None], mine] = np.swapaxes(row, 1, 2)
            before = np.concatenate([before, mine])
        return out

    @cached_property
    def _block(self) -> NDArray[np.int64]:
        """(q,) the block of each column."""
        return np.concatenate([np.full(len(place), b) for b, place in self.places.items()])

    @cached_property
    def _squares(self) -> Array:
        """(K, q) of every column with itself."""
        return np.concatenate([np.einsum("kii->ki", own) for own in self._own.values()], axis=1)

    def with_block(self, b: int, columns: Array) -> Shares:
        """The same with a block more behind; columns: (n, q') all of them then."""
        place = np.arange(self.columns.shape[1], columns.shape[1])
        return Shares(self.noise, columns, {**self.places, b: place}, self._own)

    @cached_property
    def _own(self) -> dict[int, Array]:
        """Block -> (K, k, k)."""
        return {**self.known, **self._made([b for b in self.places if b not in self.known])}

    def _made(self, blocks: Sequence[int]) -> dict[int, Array]:
        """Block -> (K, k, k) of the last blocks."""
        if not blocks:
            return {}
        effects, theta = self.noise.covariance.effects, self.noise.variances.theta
        first = self.places[blocks[0]][0]
        places = {b: self.places[b] - first for b in blocks}
        U = self.noise.covariance.whiten_transposed(self.columns[:, first:])
        drawn = np.swapaxes(effects.drawn(effects.slopes.T, U), 0, 1)
        moving = range(effects.count - len(effects.drifts), effects.count)
        images = [effects.times(k, U) for k in moving]
        single = np.array([p[0] for p in places.values() if len(p) == 1], dtype=np.int64)
        alone = np.array(
            [
                *(effects.diagonals @ U[:, single] ** 2),
                *np.sum(drawn[:, :, single] ** 2, axis=1),
                *(np.sum(U[:, single] * x[:, single], axis=0) for x in images),
            ]
        )

        weights = np.ascontiguousarray(effects.diagonals.T)[:, :, None]

        def several(p: NDArray[np.int64]) -> Array:
            mine, k = slice(p[0], p[-1] + 1), len(p)
            V, roots = np.ascontiguousarray(U[:, mine]), drawn[:, :, mine]
            own = (V.T @ (weights * V[:, None, :]).reshape(len(V), -1)).reshape(k, -1, k)
            between = np.swapaxes(roots, 1, 2) @ roots
            return np.concatenate(
                [np.swapaxes(own, 0, 1), between, *((V.T @ x[:, mine])[None] for x in images)]
            )

        at = dict(zip(single.tolist(), alone.T, strict=True))
        found = {b: at[p[0]][:, None, None] if len(p) == 1 else several(p) for b, p in places.items()}
        return {b: theta[:, None, None] * x for b, x in found.items()}

    def _row(self, b: int) -> Array:
        """(K, k, q) of a block's columns with all others."""
        if b not in self.rows:
            v, place = self.noise.covariance, self.places[b]
            U = v.whiten_transposed(self.columns[:, place[0] : place[-1] + 1])
            images = np.concatenate([v.effects.times(k, U) for k in range(v.effects.count)], axis=1)
            row = (v.whiten(images).T @ self.columns).reshape(v.effects.count, len(place), -1)
            self.rows[b] = self.noise.variances.theta[:, None, None] * row
        return self.rows[b]


def freedom_of(each: Sequence[tuple[ChannelNoise, Array]]) -> float:
    """Satterthwaite's freedom of contrasts over several channels: 2 over the relative variance of theirs.

    each: a channel's noise and its whitened rows C (n, m), Σ CᵀC = I. A variance that channels were found to
    have in common is known no better for being asked by all of them.
    """
    total = sum(float(np.sum(C**2)) for _, C in each)
    spread = 0.0
    met: dict[tuple[str, float], float] = {}  # by variances, of which a common one has one error
    for noise, C in each:
        every = np.arange(C.shape[1])
        share = np.trace(Shares(noise, C, {0: every}).of(every), axis1=1, axis2=2) / total
        known = noise.relative_error
        spread += float(share @ known @ share)
        for k, name in enumerate(noise.components):
            same = name, float(f"{known[k, k]:.9e}")
            spread += 2.0 * met.get(same, 0.0) * share[k] * known[k, k]
            met[same] = met.get(same, 0.0) + share[k]
    return float(degrees(spread))


def degrees(spread: Array | float) -> Array:
    """Degrees of freedom of estimated variances, by their own variances over their squares."""
    return np.asarray(np.clip(2.0 / np.maximum(spread, 1e-12), 1.0, 1e6))
