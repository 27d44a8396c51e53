"""V(θ) with processes over time inside the groups: dense blocks, group by group, those of one size at a time.

    V = Σ_k θ_k V_k,   V_k diagonal, z zᵀ, or z zᵀ ∘ exp(−|Δt| / τ) (first-order Gauss-Markov) in every group

Groups are power-ons of a dozen records or so: a dense block costs less than any structure in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.random_effects import NoNoise, RandomEffects

LARGEST = 64  # rows of a group up to which blocks are dense


@dataclass(frozen=True)
class _Batch:
    """Groups of one size. rows: (G, m); inverse_root: (G, m, m) lower triangular L⁻¹ with V = L Lᵀ."""

    rows: NDArray[np.int64]
    inverse_root: Array

    @cached_property
    def inverse(self) -> Array:
        """(G, m, m) V⁻¹."""
        return np.asarray(np.swapaxes(self.inverse_root, 1, 2) @ self.inverse_root)


@dataclass(frozen=True)
class BlockCovariance:
    """V(θ) factored block by block; the same questions as `random_effects.Covariance` answers."""

    effects: RandomEffects
    theta: Array
    batches: tuple[_Batch, ...]

    @cached_property
    def diagonal(self) -> Array:
        """(n,) the variance that each row has by itself."""
        own = self.effects.diagonals
        return np.asarray(self.theta[: len(own)] @ own)

    def whiten(self, A: Array) -> Array:
        """W A for A (n, m), W = L⁻¹ block by block: W V Wᵀ = I."""
        out = np.empty_like(A, dtype=np.float64)
        for b in self.batches:
            out[b.rows] = b.inverse_root @ A[b.rows]
        return out

    def whiten_transposed(self, A: Array) -> Array:
        """Wᵀ A for A (n, m)."""
        out = np.empty_like(A, dtype=np.float64)
        for b in self.batches:
            out[b.rows] = np.swapaxes(b.inverse_root, 1, 2) @ A[b.rows]
        return out

    def solve(self, A: Array) -> Array:
        """V⁻¹ A for A (n, m)."""
        out = np.empty_like(A, dtype=np.float64)
        for b in self.batches:
            out[b.rows] = b.inverse @ A[b.rows]
        return out

    def quadratic(self, A: Array) -> Array:
        """(m, m) AᵀV⁻¹A for A (n, m)."""
        white = self.whiten(A)
        return np.asarray(white.T @ white)

    def within(self, A: Array) -> Array:
        """(K,) tr AᵀV_kA for A (n, m)."""
        e = self.effects
        return np.array([float(np.vdot(A, e.times(k, A))) for k in range(e.count)])

    def between(self, A: Array) -> Array:
        """(K, K) tr AᵀV_kV⁻¹V_lA − ½ tr AᵀV_kAAᵀV_lA for A (n, m)."""
        images = [self.effects.times(k, A) for k in range(self.effects.count)]
        white = np.array([self.whiten(image).ravel() for image in images])
        inner = np.array([(A.T @ image).ravel() for image in images])
        return np.asarray(white @ white.T - 0.5 * inner @ inner.T)

    @property
    def log_determinant(self) -> float:
        """log |V|."""
        diagonals = [np.diagonal(b.inverse_root, axis1=1, axis2=2) for b in self.batches]
        return float(-2.0 * sum(np.log(d).sum() for d in diagonals))

    def trace(self, k: int) -> float:
        """tr V⁻¹ V_k."""
        e = self.effects
        a, c = len(e.diagonals), len(e.diagonals) + len(e.slopes)
        if k < a:
            return float(sum(np.einsum("gii,gi->", b.inverse, e.diagonals[k][b.rows]) for b in self.batches))
        if k < c:
            z = e.slopes[k - a][:, None]
            return float(np.sum(self.whiten(z) ** 2))
        return float(sum(np.vdot(b.inverse, e.drifted[i][k - c]) for i, b in enumerate(self.batches)))

    def double_traces(self) -> Array:
        """(K, K) tr V⁻¹ V_k V⁻¹ V_l."""
        K = self.effects.count
        out = np.zeros((K, K))
        for i, b in enumerate(self.batches):
            products = [b.inverse @ block(self.effects, k, i) for k in range(K)]
            flat = np.array([p.ravel() for p in products])
            turned = np.array([np.swapaxes(p, 1, 2).ravel() for p in products])
            out += flat @ turned.T
        return out


def block_covariance(effects: RandomEffects, theta: Array) -> BlockCovariance:
    """V(θ) ready for use. Raises NoNoise when a block is not positive definite."""
    batches = []
    a, c = len(effects.diagonals), len(effects.diagonals) + len(effects.slopes)
    own, Z = theta[:a] @ effects.diagonals, (np.sqrt(theta[a:c])[:, None] * effects.slopes).T
    for i, rows in enumerate(effects.batches):
        V = Z[rows] @ np.swapaxes(Z[rows], 1, 2)
        for variance, drifted in zip(theta[c:], effects.drifted[i], strict=True):
            V += variance * drifted
        one = np.arange(rows.shape[1])
        V[:, one, one] += own[rows]
        try:
            root = np.linalg.cholesky(V)
        except np.linalg.LinAlgError as error:
            raise NoNoise("every row needs a positive noise variance") from error
        batches.append(_Batch(rows, np.asarray(np.linalg.inv(root))))
    return BlockCovariance(effects, theta, tuple(batches))


def block(effects: RandomEffects, k: int, i: int) -> Array:
    """(G, m, m) V_k in the groups of one size, the i-th of `batches`."""
    a, b, rows = len(effects.diagonals), len(effects.slopes), effects.batches[i]
    if k < a:
        return np.asarray(effects.diagonals[k][rows][:, :, None] * np.eye(rows.shape[1]))
    if k < a + b:
        z = effects.slopes[k - a][rows]
        return np.asarray(z[:, :, None] * z[:, None, :])
    return effects.drifted[i][k - a - b]
