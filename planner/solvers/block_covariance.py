"""V(θ) with processes over time inside the groups: dense blocks, group by group, those of one size at a time.

    V = Σ_k θ_k V_k,   V_k diagonal, z zᵀ, or z zᵀ ∘ exp(−|Δt| / τ) (first-order Gauss-Markov) in every group

Groups are power-ons of a dozen records or so: a dense block costs less than any structure in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.nouns.array import Array
from planner.solvers.group_batches import Batch
from planner.solvers.random_effects import NoNoise, RandomEffects
from planner.solvers.triangles import inverse_of_triangles

LARGEST = 64  # rows of a group up to which blocks are dense


@dataclass(frozen=True)
class _Blocks:
    """Of the groups of one size. inverse_root: (G, m, m) lower triangular L⁻¹ with V = L Lᵀ.

    diagonals: (a, G, m) of V_1 …; slopes: (b, G, m) the z of V_{a+1} …; drifts: (G, m, m) each, V_{a+b+1} …
    """

    batch: Batch
    diagonals: Array
    slopes: Array
    drifts: Sequence[Array]
    inverse_root: Array

    @cached_property
    def inverse(self) -> Array:
        """(G, m, m) V⁻¹."""
        return np.array([root.T @ root for root in self.inverse_root])  # one by one: half of the work

    def traces(self, N: Array) -> Array:
        """(…, K) Σ tr V_k N of the groups' own N (…, G, m, m)."""
        own = np.einsum("kgi,...gii->...k", self.diagonals, N)
        met = N @ np.moveaxis(self.slopes, 0, 2)  # (…, G, m, b)
        drawn = np.einsum("kgi,...gik->...k", self.slopes, met)
        drifting = [np.einsum("gij,...gij->...", drift, N)[..., None] for drift in self.drifts]
        return np.concatenate([own, drawn, *drifting], axis=-1)

    @cached_property
    def weighed(self) -> Array:
        """(K, G, m, m) V⁻¹ V_k."""
        solved = (self.inverse @ self.slopes[..., None]) * self.slopes[:, :, None, :]
        drifting = [self.inverse @ drift for drift in self.drifts]
        return np.array([*(self.inverse * self.diagonals[:, :, None, :]), *solved, *drifting])


@dataclass(frozen=True)
class BlockCovariance:
    """V(θ) factored block by block; the same questions as `random_effects.Covariance` answers."""

    effects: RandomEffects
    theta: Array
    blocks: tuple[_Blocks, ...]

    @cached_property
    def diagonal(self) -> Array:
        """(n,) the variance that each row has by itself."""
        own = self.effects.diagonals
        return np.asarray(self.theta[: len(own)] @ own)

    def whiten(self, A: Array) -> Array:
        """W A for A (n, m), W = L⁻¹ block by block: W V Wᵀ = I."""
        return self._block_by_block([b.inverse_root for b in self.blocks], A)

    def whiten_transposed(self, A: Array) -> Array:
        """Wᵀ A for A (n, m)."""
        return self._block_by_block([np.swapaxes(b.inverse_root, 1, 2) for b in self.blocks], A)

    def solve(self, A: Array) -> Array:
        """V⁻¹ A for A (n, m)."""
        return self._block_by_block([b.inverse for b in self.blocks], A)

    def _block_by_block(self, factors: Sequence[Array], A: Array) -> Array:
        """(n, m) of A (n, m), every group's rows times its own factor (G, m, m)."""
        out = np.empty(A.shape)
        for b, factor in zip(self.blocks, factors, strict=True):
            b.batch.put_product(out, factor, A)
        return out

    def quadratic(self, A: Array) -> Array:
        """(m, m) AᵀV⁻¹A for A (n, m)."""
        white = self.whiten(A)
        return np.asarray(white.T @ white)

    def within(self, A: Array) -> Array:
        """(K,) tr AᵀV_kA for A (n, m)."""
        return np.asarray(sum(b.traces(_square(b.batch.of(A))) for b in self.blocks))

    def between(self, A: Array) -> Array:
        """(K, K) tr AᵀV_kV⁻¹V_lA − ½ tr AᵀV_kAAᵀV_lA for A (n, m)."""
        met = np.sum([b.traces(b.weighed @ _square(b.batch.of(A))) for b in self.blocks], axis=0)
        inner = self.effects.inner(A)
        return np.asarray(met - 0.5 * inner @ inner.T)

    @property
    def log_determinant(self) -> float:
        """log |V|."""
        diagonals = [np.diagonal(b.inverse_root, axis1=1, axis2=2) for b in self.blocks]
        return float(-2.0 * sum(np.log(d).sum() for d in diagonals))

    @property
    def traces(self) -> Array:
        """(K,) tr V⁻¹ V_k."""
        return np.asarray(sum(b.traces(b.inverse) for b in self.blocks))

    def double_traces(self) -> Array:
        """(K, K) tr V⁻¹ V_k V⁻¹ V_l."""
        out = np.zeros((self.effects.count, self.effects.count))
        for b in self.blocks:
            turned = np.swapaxes(b.weighed, 2, 3)
            out += b.weighed.reshape(len(out), -1) @ turned.reshape(len(out), -1).T
        return out


def _square(A: Array) -> Array:
    """(G, m, m) A Aᵀ of every group's A (G, m, k)."""
    return np.asarray(A @ np.swapaxes(A, 1, 2))


def block_covariance(effects: RandomEffects, theta: Array) -> BlockCovariance:
    """V(θ) ready for use. Raises NoNoise when a block is not positive definite."""
    a, c = len(effects.diagonals), len(effects.diagonals) + len(effects.slopes)
    own, Z = theta[:a] @ effects.diagonals, (np.sqrt(theta[a:c])[:, None] * effects.slopes).T
    blocks = []
    for batch, drifts in zip(effects.batches, effects.drifted, strict=True):
        diagonals, slopes = effects.diagonals[:, batch.rows], effects.slopes[:, batch.rows]
        z, one = batch.of(Z), np.arange(batch.rows.shape[1])
        V = _square(z)
        for variance, drift in zip(theta[c:], drifts, strict=True):
            V += variance * drift
        V[:, one, one] += batch.of(own)
        try:
            root = np.linalg.cholesky(V)
        except np.linalg.LinAlgError as error:
            raise NoNoise("every row needs a positive noise variance") from error
        blocks.append(_Blocks(batch, diagonals, slopes, drifts, inverse_of_triangles(np.asarray(root))))
    return BlockCovariance(effects, theta, tuple(blocks))
