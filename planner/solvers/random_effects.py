"""Covariances of rows with random effects: V(θ) = Σ θ_k V_k, each V_k diagonal or z zᵀ for every group.

z = 1 is a random intercept of a group (a power-on), z = a regressor a random slope. V is block diagonal over
the groups, and V⁻¹ and its root come from small matrices (Woodbury). No inertial knowledge here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.records import Array


@dataclass(frozen=True)
class RandomEffects:
    """What V is made of. Rows of one group stand together.

    starts: (g,) first row of every group; diagonals: (a, n) of V_1 … V_a, the first positive everywhere
    slopes: (b, n) the z of V_{a+1} … V_{a+b}
    """

    starts: NDArray[np.int64]
    diagonals: Array
    slopes: Array

    @property
    def count(self) -> int:
        """How many variances there are: a + b."""
        return len(self.diagonals) + len(self.slopes)

    def sums(self, rows: Array) -> Array:
        """(n, …) rows -> (g, …) their sums over each group."""
        return np.asarray(np.add.reduceat(rows, self.starts, axis=0))

    def spread(self, groups: Array) -> Array:
        """(g, …) -> (n, …): every row has the value of its group."""
        sizes = np.diff(np.append(self.starts, self.diagonals.shape[1]))
        return np.repeat(groups, sizes, axis=0)

    def times(self, k: int, A: Array) -> Array:
        """V_k A for A (n, m)."""
        if k < len(self.diagonals):
            return np.asarray(self.diagonals[k][:, None] * A)
        z = self.slopes[k - len(self.diagonals)][:, None]
        return np.asarray(z * self.spread(self.sums(z * A)))


@dataclass(frozen=True)
class Covariance:
    """V(θ) factored: V⁻¹ = D⁻¹ − U S Uᵀ group by group, U = D⁻¹ Z (n, b), S = (I + Zᵀ D⁻¹ Z)⁻¹ (g, b, b)."""

    effects: RandomEffects
    theta: Array
    diagonal: Array
    Z: Array
    U: Array
    S: Array
    gram: Array

    def solve(self, A: Array) -> Array:
        """V⁻¹ A for A (n, m)."""
        direct = A / self.diagonal[:, None]
        if self.Z.shape[1] == 0:
            return np.asarray(direct)
        inner = self.effects.sums(np.einsum("nb,nm->nbm", self.Z, direct))
        return np.asarray(direct - np.einsum("nb,nbm->nm", self.U, self.effects.spread(self.S @ inner)))

    def whiten(self, A: Array) -> Array:
        """W A for A (n, m), W = (I + D^(−½)Z ZᵀD^(−½))^(−½) D^(−½) block by block: W V Wᵀ = I."""
        return self._root_times(A / np.sqrt(self.diagonal)[:, None])

    def whiten_transposed(self, A: Array) -> Array:
        """Wᵀ A for A (n, m); W is not symmetric where the noise differs within a group."""
        return np.asarray(self._root_times(A) / np.sqrt(self.diagonal)[:, None])

    def _root_times(self, A: Array) -> Array:
        """(I + D^(−½)Z ZᵀD^(−½))^(−½) A."""
        if self.Z.shape[1] == 0:
            return np.asarray(A)
        Z = self.Z / np.sqrt(self.diagonal)[:, None]
        value, vector = np.linalg.eigh(self.gram)
        shrink = -1.0 / (np.sqrt(1.0 + value) * (1.0 + np.sqrt(1.0 + value)))  # ((1+λ)^(−1/2) − 1)/λ
        inner = np.einsum("gbk,gk,gck->gbc", vector, shrink, vector)
        sums = self.effects.sums(np.einsum("nb,nm->nbm", Z, A))
        return np.asarray(A + np.einsum("nb,nbm->nm", Z, self.effects.spread(inner @ sums)))

    @property
    def log_determinant(self) -> float:
        """log |V|."""
        blocks = np.linalg.slogdet(np.eye(self.Z.shape[1]) + self.gram)[1] if self.Z.shape[1] else 0.0
        return float(np.log(self.diagonal).sum() + np.sum(blocks))


def covariance(effects: RandomEffects, theta: Array) -> Covariance:
    """V(θ) ready for use. Raises ValueError when its diagonal part is not positive."""
    a = len(effects.diagonals)
    diagonal = theta[:a] @ effects.diagonals
    if not (diagonal > 0).all():
        raise ValueError("every row needs a positive noise variance")
    Z = (np.sqrt(theta[a:])[:, None] * effects.slopes).T
    U = Z / diagonal[:, None]
    gram = effects.sums(np.einsum("nb,nc->nbc", U, Z))
    S = np.asarray(np.linalg.inv(np.eye(Z.shape[1]) + gram))
    return Covariance(effects, theta, diagonal, Z, U, S, gram)
