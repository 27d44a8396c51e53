"""Covariances of rows with random effects: V(θ) = Σ θ_k V_k, each V_k diagonal or z zᵀ for every group.

z = 1 is a random intercept of a group (a power-on), z = a regressor a random slope, a drift is a first-order
Gauss-Markov process within the group. V is block diagonal over the groups; V⁻¹ and its root come from small
matrices (Woodbury), with drifts from dense blocks (block_covariance). No inertial knowledge here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.group_batches import Batch, batches_of

if TYPE_CHECKING:
    from planner.solvers.block_covariance import BlockCovariance


@dataclass(frozen=True)
class Drift:
    """A process in every group, z zᵀ ∘ ρ(Δt / τ). z: (n,); time: (n,) what it runs along; tau: τ.

    ρ(x) = exp(−|x|), first-order Gauss-Markov, or smooth exp(−x²/2)
    """

    z: Array
    time: Array
    tau: float
    smooth: bool = False

    def block(self, rows: NDArray[np.int64]) -> Array:
        """(G, m, m) in groups of one size, rows (G, m)."""
        z, t = self.z[rows], self.time[rows]
        x = (t[:, :, None] - t[:, None, :]) / self.tau
        rho = np.exp(-0.5 * x**2) if self.smooth else np.exp(-np.abs(x))
        return np.asarray(z[:, :, None] * z[:, None, :] * rho)

    def at(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> Drift:
        """The process on some of the rows."""
        return replace(self, z=self.z[rows], time=self.time[rows])


@dataclass(frozen=True)
class RandomEffects:
    """What V is made of. Rows of one group stand together.

    starts: (g,) first row of every group; diagonals: (a, n) of V_1 … V_a, their sum positive everywhere
    slopes: (b, n) the z of V_{a+1} … V_{a+b}; drifts: V_{a+b+1} …; known: numbers of variances that are 1
    """

    starts: NDArray[np.int64]
    diagonals: Array
    slopes: Array
    drifts: tuple[Drift, ...] = ()
    known: tuple[int, ...] = ()

    @property
    def count(self) -> int:
        """How many variances there are."""
        return len(self.diagonals) + len(self.slopes) + len(self.drifts)

    @property
    def rows(self) -> int:
        """n."""
        return int(self.diagonals.shape[1])

    @cached_property
    def sizes(self) -> NDArray[np.int64]:
        """(g,) rows of every group."""
        return np.diff(np.append(self.starts, self.rows))

    @property
    def free(self) -> NDArray[np.bool_]:
        """(K,) variances that are not known."""
        found = np.ones(self.count, dtype=bool)
        found[list(self.known)] = False
        return found

    def of(self, keep: Sequence[int]) -> RandomEffects:
        """Some of the variances only, in their order."""
        a, b = len(self.diagonals), len(self.slopes)
        return RandomEffects(
            self.starts,
            self.diagonals[[k for k in keep if k < a]],
            self.slopes[[k - a for k in keep if a <= k < a + b]],
            tuple(self.drifts[k - a - b] for k in keep if k >= a + b),
            tuple(place for place, k in enumerate(keep) if k in self.known),
        )

    def at(self, stays: NDArray[np.bool_]) -> RandomEffects:
        """The rows of some groups only; stays: (g,)."""
        sizes = self.sizes
        rows = np.repeat(stays, sizes)
        starts = np.concatenate([[0], np.cumsum(sizes[stays])[:-1]]).astype(np.int64)
        drifts = tuple(d.at(rows) for d in self.drifts)
        return RandomEffects(starts, self.diagonals[:, rows], self.slopes[:, rows], drifts, self.known)

    @cached_property
    def order_by_size(self) -> NDArray[np.int64] | None:
        """(n,) rows with groups of one size together, of which nothing is copied; None where they are."""
        if all(batch.together for batch in self.batches):
            return None
        return np.concatenate([batch.rows.ravel() for batch in self.batches])

    def by_size(self) -> RandomEffects:
        """The rows in `order_by_size`."""
        rows = self.order_by_size
        if rows is None:
            return self
        sizes = np.concatenate([np.full(len(b.places), b.rows.shape[1]) for b in self.batches])
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64)
        drifts = tuple(d.at(rows) for d in self.drifts)
        return RandomEffects(starts, self.diagonals[:, rows], self.slopes[:, rows], drifts, self.known)

    def mean_sizes(self) -> Array:
        """(K,) mean of each V_k's diagonal; 1 where it is zero."""
        drifts = [np.mean(d.z**2) for d in self.drifts]
        size = np.array([*self.diagonals.mean(axis=1), *np.mean(self.slopes**2, axis=1), *drifts])
        return np.where(size > 0, size, 1.0)

    def scaled(self, factor: Array) -> RandomEffects:
        """Every V_k times factor_k (K,)."""
        a, b = len(self.diagonals), len(self.slopes)
        root = np.sqrt(factor)
        drifts = tuple(replace(d, z=d.z * r) for d, r in zip(self.drifts, root[a + b :], strict=True))
        return RandomEffects(
            self.starts,
            self.diagonals * factor[:a, None],
            self.slopes * root[a : a + b, None],
            drifts,
            self.known,
        )

    def sums(self, rows: Array) -> Array:
        """(n, …) rows -> (g, …) their sums over each group."""
        return np.asarray(np.add.reduceat(rows, self.starts, axis=0))

    def drawn(self, Z: Array, A: Array) -> Array:
        """(g, b, m) ZᵀA of every group, Z (n, b), A (n, m): small matrices, four times faster than sums."""
        out = np.empty((len(self.starts), Z.shape[1], A.shape[1]))
        for batch in self.batches:
            batch.put_groups(out, np.swapaxes(batch.of(Z), 1, 2) @ batch.of(A))
        return out

    def spread(self, groups: Array) -> Array:
        """(g, …) -> (n, …): every row has the value of its group."""
        return np.repeat(groups, self.sizes, axis=0)

    @cached_property
    def batches(self) -> list[Batch]:
        """The groups of every size."""
        return batches_of(self.starts, self.sizes)

    @cached_property
    def drifted(self) -> list[list[Array]]:
        """(G, m, m) of every drift, in the groups of every size in `batches`."""
        return [[d.block(batch.rows) for d in self.drifts] for batch in self.batches]

    def by_group(
        self, part: Callable[..., Array], columns: Sequence[Array], groups: Sequence[Array]
    ) -> Array:
        """(n, m) of part(columns (G, m, …)…, groups (G, …)…)."""
        out = np.empty((self.rows, columns[-1].shape[1]))
        for batch in self.batches:
            batch.put(out, part(*map(batch.of, columns), *map(batch.of_groups, groups)))
        return out

    def take(self, A: Array, U: Array, S: Array, Z: Array) -> None:
        """A (n, m) becomes A − U S Zᵀ A group by group, in its place: U, Z (n, b), S (g, b, b)."""
        for batch in self.batches:
            u, z = batch.of(U), batch.of(Z)
            batch.take(A, u @ (batch.of_groups(S) @ (np.swapaxes(z, 1, 2) @ batch.of(A))))

    def pulled(self, y: Array) -> Array:
        """(n, K) every V_k y, y (n,)."""
        z, c = self.slopes.T, len(self.diagonals) + len(self.slopes)
        out = np.empty((self.rows, self.count))
        out[:, : len(self.diagonals)] = (self.diagonals * y).T
        out[:, len(self.diagonals) : c] = z * self.spread(self.sums(z * y[:, None]))
        for k in range(c, self.count):
            out[:, k] = self._drifted(k, y[:, None])[:, 0]
        return out

    def times(self, k: int, A: Array) -> Array:
        """V_k A for A (n, m)."""
        if k < len(self.diagonals):
            return np.asarray(self.diagonals[k][:, None] * A)
        if k >= len(self.diagonals) + len(self.slopes):
            return self._drifted(k, A)
        z = self.slopes[k - len(self.diagonals)][:, None]
        return self.by_group(_outer_times, (z, A), ())

    def inner(self, A: Array) -> Array:
        """(K, m²) every AᵀV_kA for A (n, m); of one array with itself half of the work."""
        drawn, out = self.drawn(self.slopes.T, A), np.empty((self.count, A.shape[1], A.shape[1]))
        a, c = len(self.diagonals), len(self.diagonals) + len(self.slopes)
        for k in range(self.count):
            left = self._root_of(k, A) if k < a else drawn[:, k - a] if k < c else A
            right = self._drifted(k, A) if k >= c else left
            np.matmul(left.T, right, out=out[k])
        return out.reshape(self.count, A.shape[1] ** 2)

    def _root_of(self, k: int, A: Array) -> Array:
        """V_k^(½) A of a diagonal one, of the rows where it is something: some noise goes with the rate."""
        here = self.diagonals[k] > 0.0
        rows = slice(None) if here.all() else here
        return np.asarray(np.sqrt(self.diagonals[k, rows])[:, None] * A[rows])

    def _drifted(self, k: int, A: Array) -> Array:
        out = np.empty(A.shape)
        for batch, drifted in zip(self.batches, self.drifted, strict=True):
            batch.put_product(out, drifted[k - len(self.diagonals) - len(self.slopes)], A)
        return out


@dataclass(frozen=True)
class Covariance:
    """V(θ) factored: V⁻¹ = D⁻¹ − U S Uᵀ group by group, U = D⁻¹ Z (n, c), S = (I + Zᵀ D⁻¹ Z)⁻¹ (g, c, c).

    some: (c,) the slopes of which the variance is something; Z = [√θ_k z_k] of these; gram: Zᵀ D⁻¹ Z
    """

    effects: RandomEffects
    theta: Array
    diagonal: Array
    some: NDArray[np.int64]
    Z: Array
    U: Array
    S: Array
    gram: Array

    def solve(self, A: Array) -> Array:
        """V⁻¹ A for A (n, m)."""
        found = np.asarray(A * (1.0 / self.diagonal)[:, None])
        if self.Z.shape[1]:
            self.effects.take(found, self.U, self.S, self.Z)
        return found

    def quadratic(self, A: Array) -> Array:
        """(m, m) AᵀV⁻¹A for A (n, m): a product of matrices and sums over groups."""
        scaled = A * self._weights
        found = scaled.T @ scaled  # of one array with itself: half of the work
        if self.Z.shape[1]:
            flat = self.effects.drawn(self._halves, scaled).reshape(-1, A.shape[1])
            found -= flat.T @ flat
        return np.asarray(found)

    @cached_property
    def _weights(self) -> Array:
        """(n, 1) D^(−½)."""
        return np.asarray(1.0 / np.sqrt(self.diagonal))[:, None]

    @cached_property
    def _halves(self) -> Array:
        """(n, c) D^(−½) Z L group by group, L Lᵀ = S."""
        root = np.asarray(np.linalg.cholesky(self.S))
        return self.effects.by_group(np.matmul, (self.Z * self._weights,), (root,))

    def whiten(self, A: Array) -> Array:
        """W A for A (n, m), W = (I + D^(−½)Z ZᵀD^(−½))^(−½) D^(−½) block by block: W V Wᵀ = I."""
        return self._root_times(A * self._weights)

    def whiten_transposed(self, A: Array) -> Array:
        """Wᵀ A for A (n, m); W is not symmetric where the noise differs within a group."""
        found = self._root_times(np.array(A, dtype=float))
        found *= self._weights
        return found

    def _root_times(self, A: Array) -> Array:
        """(I + D^(−½)Z ZᵀD^(−½))^(−½) A, in the place of A."""
        if self.Z.shape[1]:
            Z, inner = self._root
            self.effects.take(A, Z, inner, Z)
        return A

    @cached_property
    def _root(self) -> tuple[Array, Array]:
        """D^(−½)Z (n, c) and T (g, c, c), (I + D^(−½)Z ZᵀD^(−½))^(−½) = I − D^(−½)Z T ZᵀD^(−½)."""
        value, vector = np.linalg.eigh(self.gram)
        shrink = 1.0 / (np.sqrt(1.0 + value) * (1.0 + np.sqrt(1.0 + value)))  # (1 − (1+λ)^(−1/2))/λ
        inner = np.einsum("gbk,gk,gck->gbc", vector, shrink, vector)
        return self.Z * self._weights, inner

    @property
    def log_determinant(self) -> float:
        """log |V|."""
        blocks = np.linalg.slogdet(np.eye(self.Z.shape[1]) + self.gram)[1] if self.Z.shape[1] else 0.0
        return float(np.log(self.diagonal).sum() + np.sum(blocks))

    @property
    def traces(self) -> Array:
        """(K,) tr V⁻¹ V_k."""
        e = self.effects
        own = e.diagonals @ (1.0 / self.diagonal - self._taken)
        return np.concatenate([own, np.einsum("bn,nb->b", e.slopes, self._slopes)])

    @cached_property
    def _slopes(self) -> Array:
        """(n, b) V⁻¹ z."""
        return self.solve(self.effects.slopes.T)

    @cached_property
    def _taken(self) -> Array:
        """(n,) diagonal of U S Uᵀ."""
        return np.asarray(np.einsum("nb,nbc,nc->n", self.U, self.effects.spread(self.S), self.U))

    def within(self, A: Array) -> Array:
        """(K,) tr AᵀV_kA for A (n, m)."""
        e = self.effects
        drawn = np.einsum("gbm,gbm->b", *2 * (e.drawn(e.slopes.T, A),))
        return np.concatenate([e.diagonals @ np.einsum("nm,nm->n", A, A), drawn])

    def between(self, A: Array) -> Array:
        """(K, K) tr AᵀV_kV⁻¹V_lA − ½ tr AᵀV_kAAᵀV_lA for A (n, m)."""
        e, a = self.effects, len(self.effects.diagonals)
        z, inner = e.slopes.T, e.inner(A)
        weights = np.vstack([e.diagonals / self.diagonal, np.ones(e.rows)])
        weighed = np.einsum("kn,nb->nkb", weights, z).reshape(e.rows, -1)
        drawn = e.drawn(weighed, A)  # zᵀD⁻¹V_kA of the diagonal ones, zᵀA
        shape = len(e.starts), *2 * (a + 1, len(e.slopes))
        met = (drawn @ np.swapaxes(drawn, 1, 2)).reshape(shape)
        M = np.zeros((len(e.starts), *2 * (len(e.slopes),)))
        root = np.sqrt(self.theta[a:][self.some])
        M[:, self.some[:, None], self.some] = np.outer(root, root) * self.S
        gram = e.sums(np.einsum("nb,nc->nbc", z / self.diagonal[:, None], z))
        taken = gram @ M
        size = np.einsum("nm,nm->n", A, A)
        out = np.empty((e.count, e.count))
        out[:a, :a] = e.diagonals * (size / self.diagonal) @ e.diagonals.T
        out[:a, :a] -= np.einsum("gkbmc,gbc->km", met[:, :a, :, :a], M)
        left = np.einsum("gkbb->kb", met[:, :a, :, a]) - np.einsum("gbc,gkcb->kb", taken, met[:, :a, :, a])
        out[:a, a:], out[a:, :a] = left, left.T
        out[a:, a:] = np.einsum("gbc,gbc->bc", gram - taken @ gram, met[:, a, :, a])
        return out - 0.5 * inner @ inner.T

    def double_traces(self) -> Array:
        """(K, K) tr V⁻¹ V_k V⁻¹ V_l."""
        e, a = self.effects, len(self.effects.diagonals)
        out = np.zeros((e.count, e.count))
        solved, taken = self._slopes, self._taken
        inner = [self.S @ e.sums(np.einsum("n,nb,nc->nbc", d, self.U, self.U)) for d in e.diagonals]
        for k in range(e.count):
            for m in range(k, e.count):
                if m < a:
                    product = e.diagonals[k] * e.diagonals[m] / self.diagonal
                    both = np.einsum("gbc,gcb->", inner[k], inner[m])
                    out[k, m] = np.sum(product * (1.0 / self.diagonal - 2.0 * taken)) + both
                elif k < a:
                    out[k, m] = np.sum(e.diagonals[k] * solved[:, m - a] ** 2)
                else:
                    out[k, m] = np.sum(e.sums(e.slopes[k - a] * solved[:, m - a]) ** 2)
                out[m, k] = out[k, m]
        return out


class NoNoise(ValueError):
    """V has a row without noise: nothing can be weighed by its inverse."""


def _outer_times(z: Array, A: Array) -> Array:
    """(G, m, k) z zᵀ A."""
    return np.asarray(z * (np.swapaxes(z, 1, 2) @ A))


def covariance(effects: RandomEffects, theta: Array) -> Covariance | BlockCovariance:
    """V(θ) ready for use. Raises NoNoise when its diagonal part is not positive."""
    if effects.drifts:
        from planner.solvers.block_covariance import block_covariance

        return block_covariance(effects, theta)
    return woodbury(effects, theta)


def woodbury(effects: RandomEffects, theta: Array) -> Covariance:
    """V(θ) without drifts. Raises NoNoise when its diagonal part is not positive."""
    a = len(effects.diagonals)
    diagonal = theta[:a] @ effects.diagonals
    if not (diagonal > 0).all():
        raise NoNoise("every row needs a positive noise variance")
    some = np.flatnonzero(theta[a:])
    Z = (np.sqrt(theta[a:][some])[:, None] * effects.slopes[some]).T
    U = Z / diagonal[:, None]
    gram = effects.sums(np.einsum("nb,nc->nbc", U, Z))
    S = np.asarray(np.linalg.inv(np.eye(Z.shape[1]) + gram))
    return Covariance(effects, theta, diagonal, some, Z, U, S, gram)
