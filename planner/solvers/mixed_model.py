"""Generalised least squares with random effects: y = X β + e, cov(e) = V(θ) = Σ θ_k V_k, θ by REML.

V_k is a diagonal matrix, or one z zᵀ for every group (a run): a random intercept has z = 1, a random slope
z = the regressor. V is block diagonal over the groups and V⁻¹ comes from small matrices (Woodbury).
No inertial knowledge here. X enters through an orthonormal basis of its columns, so that the inverse of
XᵀV⁻¹X is one of a well-conditioned matrix however ill-conditioned X is.

Sources: Patterson, Thompson, Biometrika 58 (1971) 545 (REML); Kenward, Roger, Biometrics 53 (1997) 983
(covariance and degrees of freedom for few groups); Satterthwaite, Biometrics Bull. 2 (1946) 110.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.solvers.least_squares import Array, Factors, factors

_MOST_STEPS = 60
_CONVERGED = 1e-7  # of the REML log-likelihood; θ is then within 0.05 % of a standard error
_LEAST_SHARE = 1e-9  # of the total variance, below which a component counts as none


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


# ---------------------------------------------------------------- traces that scoring needs


def _trace(v: Covariance, k: int) -> float:
    """tr V⁻¹ V_k."""
    a = len(v.effects.diagonals)
    if k >= a:
        z = v.effects.slopes[k - a]
        return float(z @ v.solve(z[:, None])[:, 0])
    return float(np.sum(v.effects.diagonals[k] * (1.0 / v.diagonal - _taken(v))))


def _taken(v: Covariance) -> Array:
    """(n,) diagonal of U S Uᵀ."""
    return np.asarray(np.einsum("nb,nbc,nc->n", v.U, v.effects.spread(v.S), v.U))


def _double_traces(v: Covariance) -> Array:
    """(K, K) tr V⁻¹ V_k V⁻¹ V_l."""
    e, a = v.effects, len(v.effects.diagonals)
    out = np.zeros((e.count, e.count))
    solved = v.solve(e.slopes.T)
    taken = _taken(v)
    inner = [v.S @ e.sums(np.einsum("n,nb,nc->nbc", d, v.U, v.U)) for d in e.diagonals]
    for k in range(e.count):
        for m in range(k, e.count):
            if m < a:
                product = e.diagonals[k] * e.diagonals[m] / v.diagonal
                both = np.einsum("gbc,gcb->", inner[k], inner[m])
                out[k, m] = np.sum(product * (1.0 / v.diagonal - 2.0 * taken)) + both
            elif k < a:
                out[k, m] = np.sum(e.diagonals[k] * solved[:, m - a] ** 2)
            else:
                out[k, m] = np.sum(e.sums(e.slopes[k - a] * solved[:, m - a]) ** 2)
            out[m, k] = out[k, m]
    return out


# ---------------------------------------------------------------- REML


@dataclass(frozen=True)
class _State:
    """Everything at one θ: log-likelihood, score, and the matrices of the fixed effects' basis."""

    v: Covariance
    B: Array  # V⁻¹ X
    C: Array  # (Xᵀ V⁻¹ X)⁻¹
    Py: Array
    loglik: float


def _state(y: Array, X: Array, effects: RandomEffects, theta: Array) -> _State:
    """REML log-likelihood −½ (log|V| + log|XᵀV⁻¹X| + yᵀPy) at θ; y (n,), X (n, r) orthonormal."""
    v = covariance(effects, theta)
    solved = v.solve(np.column_stack([X, y]))
    B, Vy = solved[:, :-1], solved[:, -1]
    information = X.T @ B
    information = (information + information.T) / 2.0
    C = np.asarray(np.linalg.inv(information))
    Py = Vy - B @ (C @ (X.T @ Vy))
    log = v.log_determinant + np.linalg.slogdet(information)[1] + float(y @ Py)
    return _State(v, B, C, Py, -0.5 * float(log))


def _derivatives(y: Array, s: _State) -> tuple[Array, Array, list[Array], list[list[Array]]]:
    """Score (K,), expected information (K, K), A_k = BᵀV_kB, and Q_kl = BᵀV_kV⁻¹V_lB (Kenward, Roger)."""
    e = s.v.effects
    images = [e.times(k, s.B) for k in range(e.count)]
    A = [s.B.T @ image for image in images]
    solved = [s.v.solve(image) for image in images]
    Q = [[images[k].T @ solved[m] for m in range(e.count)] for k in range(e.count)]
    Py = s.Py[:, None]
    quadratic = np.array([float(s.Py @ e.times(k, Py)[:, 0]) for k in range(e.count)])
    trace = np.array([_trace(s.v, k) - np.sum(s.C * A[k]) for k in range(e.count)])
    CA = [s.C @ a for a in A]
    information = _double_traces(s.v)
    for k in range(e.count):
        for m in range(e.count):
            information[k, m] += np.sum(CA[k] * CA[m].T) - 2.0 * np.sum(s.C * Q[k][m])
    return 0.5 * (quadratic - trace), 0.5 * information, A, Q


def _average_information(y: Array, s: _State) -> tuple[Array, Array]:
    """Score (K,) and average information (K, K), ½ yᵀPV_kPV_lPy (Gilmour, Thompson, Cullis 1995).

    As good a curvature for the search as the expected one, for K products of matrices in place of K².
    """
    e = s.v.effects
    pulled = np.column_stack([e.times(k, s.Py[:, None]) for k in range(e.count)])
    projected = s.v.solve(pulled)
    projected = projected - s.B @ (s.C @ (s.B.T @ pulled))
    trace = np.array([_trace(s.v, k) - np.sum(s.C * (s.B.T @ e.times(k, s.B))) for k in range(e.count)])
    return 0.5 * (s.Py @ pulled - trace), 0.5 * (pulled.T @ projected)


@dataclass(frozen=True)
class Variances:
    """REML estimates. theta: (K,) in the order of RandomEffects; error: (K, K) their covariance.

    free: (K,) False where the estimate is zero and held there (its row of `error` is zero)
    """

    theta: Array
    error: Array
    free: NDArray[np.bool_]
    loglik: float
    converged: bool


@dataclass(frozen=True)
class Sample:
    """One data set for the variances: y (n,) given X (n, p), with what its V is made of."""

    y: Array
    X: Array
    effects: RandomEffects


def reml(y: Array, X: Array, effects: RandomEffects, start: Array | None = None) -> Variances:
    """Variances θ >= 0 that maximise the restricted likelihood of y (n,) given X (n, p).

    Scoring with the average, at the end the expected information; components driven below zero are held at
    zero and released when their score turns positive. Raises ValueError when no degree of freedom is left
    for the noise.
    """
    return reml_together([Sample(y, X, effects)], start)


def reml_together(samples: Sequence[Sample], start: Array | None = None) -> Variances:
    """Variances that several independent samples share, each with coefficients of its own.

    The likelihoods are multiplied. Raises ValueError as `reml`.
    """
    count = samples[0].effects.count
    bases = [factors(s.X).basis for s in samples]
    y = [s.y - basis @ (basis.T @ s.y) for s, basis in zip(samples, bases, strict=True)]
    freedom = sum(len(basis) - basis.shape[1] for basis in bases)
    if any(len(basis) - basis.shape[1] < 1 for basis in bases):
        raise ValueError("as many coefficients as rows: nothing is left to estimate the noise from")
    total = sum(float(part @ part) for part in y) / freedom
    if total <= 0.0:
        return Variances(np.zeros(count), np.zeros((count, count)), np.zeros(count, bool), 0.0, True)
    size = np.mean([_sizes(s.effects) for s in samples], axis=0)
    parts = [
        Sample(part / np.sqrt(total), basis, _divided(s.effects, size))
        for s, part, basis in zip(samples, y, bases, strict=True)
    ]
    theta = np.full(count, 1.0 / count) if start is None else start * size / total
    theta = np.maximum(theta, 1e-3 * (np.arange(count) == 0))
    theta, error, free, loglik, done = _scored(parts, theta)
    factor = total / size
    return Variances(theta * factor, error * np.outer(factor, factor), free, loglik, done)


def restricted_loglik(sample: Sample, theta: Array) -> float:
    """−½ (log|V| + log|QᵀV⁻¹Q| + yᵀPy) at θ, Q an orthonormal basis of X: differences over θ count."""
    basis = factors(sample.X).basis
    return _state(sample.y - basis @ (basis.T @ sample.y), basis, sample.effects, theta).loglik


def reml_information(X: Array, effects: RandomEffects, theta: Array) -> Array:
    """(K, K) expected information on all variances at θ, those at zero too; X (n, p) fixed effects.

    Its inverse is how well the data could tell θ, whatever they told (Variances.error leaves out zeros).
    """
    basis = factors(X).basis
    size = _sizes(effects)
    scaled = _divided(effects, size)
    total = max(float(np.sum(theta * size)), 1e-300)
    state = _state(np.zeros(len(basis)), basis, scaled, theta * size / total)
    _, information, _, _ = _derivatives(np.zeros(len(basis)), state)
    return np.asarray(information * np.outer(size, size) / total**2)


def _sizes(effects: RandomEffects) -> Array:
    """(K,) mean diagonal of every component; divided by it one tolerance serves all."""
    size = np.concatenate([effects.diagonals, effects.slopes**2]).mean(axis=1)
    return np.asarray(np.where(size > 0, size, 1.0))


def _divided(effects: RandomEffects, size: Array) -> RandomEffects:
    a = len(effects.diagonals)
    return RandomEffects(
        effects.starts, effects.diagonals / size[:a, None], effects.slopes / np.sqrt(size[a:, None])
    )


def _scored(samples: Sequence[Sample], theta: Array) -> tuple[Array, Array, NDArray[np.bool_], float, bool]:
    states, done, expected = _states(samples, theta), False, False
    for _ in range(_MOST_STEPS):
        score, information = _slope(samples, states, expected)
        free = (theta > _LEAST_SHARE) | (score > 0)
        step = np.zeros_like(theta)
        step[free] = np.linalg.lstsq(information[np.ix_(free, free)], score[free], rcond=1e-10)[0]
        new, better = _improved(samples, theta, step, _total(states))
        settled = better is None or _total(better) - _total(states) < _CONVERGED
        if better is not None:
            theta, states = new, better
        if settled and expected:
            done = True
            break
        expected = settled  # the average information may be blind to a component; the expected one is not
    theta = np.where(theta > _LEAST_SHARE, theta, 0.0)
    free = theta > 0
    _, information = _slope(samples, states, True)
    error = np.zeros((len(theta), len(theta)))
    error[np.ix_(free, free)] = np.linalg.pinv(information[np.ix_(free, free)])
    return theta, error, free, _total(states), done


def _states(samples: Sequence[Sample], theta: Array) -> list[_State]:
    return [_state(s.y, s.X, s.effects, theta) for s in samples]


def _total(states: Sequence[_State]) -> float:
    return sum(s.loglik for s in states)


def _slope(samples: Sequence[Sample], states: Sequence[_State], expected: bool) -> tuple[Array, Array]:
    """Score (K,) and information (K, K) of all samples together."""
    parts = [
        _derivatives(sample.y, state)[:2] if expected else _average_information(sample.y, state)
        for sample, state in zip(samples, states, strict=True)
    ]
    return np.sum([p[0] for p in parts], axis=0), np.sum([p[1] for p in parts], axis=0)


def _improved(
    samples: Sequence[Sample], theta: Array, step: Array, now: float
) -> tuple[Array, list[_State] | None]:
    """The longest halved step that raises the likelihood; the noise keeps a tenth of what it was."""
    floor = np.where(np.arange(len(theta)) == 0, 0.1 * theta[0], 0.0)
    for halving in range(12):
        new = np.maximum(theta + step * 0.5**halving, floor)
        states = _states(samples, new)
        if np.isfinite(_total(states)) and _total(states) > now:
            return new, states
    return theta, None


# ---------------------------------------------------------------- fixed effects


@dataclass(frozen=True)
class MixedFit:
    """β with what is known of it.

    coefficients: (p,); covariance: (p, p), adjusted for the estimated variances (Kenward-Roger)
    freedom: (p,) Satterthwaite degrees of freedom; undetermined: (p,) takes part in a null combination
    factors: of the whitened X; whitened: (n,) residuals that should be white with unit variance
    """

    coefficients: Array
    covariance: Array
    freedom: Array
    undetermined: NDArray[np.bool_]
    factors: Factors
    variances: Variances
    whitened: Array


def mixed_fit(y: Array, X: Array, effects: RandomEffects, variances: Variances) -> MixedFit:
    """Generalised least squares of y (n,) on X (n, p) with V(θ) given, and honest intervals.

    Φ_A = Φ + 2 Φ [Σ W_kl (Q_kl − A_k Φ A_l)] Φ,   ν_j = 2 Φ_jj² / (gᵀWg),  g_k = (Φ A_k Φ)_jj
    with W = cov(θ), A_k = XᵀV⁻¹V_kV⁻¹X, Q_kl = XᵀV⁻¹V_kV⁻¹V_lV⁻¹X.
    """
    v = covariance(effects, variances.theta)
    white = v.whiten(np.column_stack([X, y]))
    found = factors(white[:, :-1])
    beta = found.to_coefficients @ (found.basis.T @ white[:, -1])
    residual = white[:, -1] - white[:, :-1] @ beta
    beta = beta + found.to_coefficients @ (found.basis.T @ residual)  # one refinement
    state = _State(v, v.solve(X @ found.to_coefficients), np.eye(found.rank), np.zeros(len(y)), 0.0)
    adjusted, freedom = _small_sample(state, variances, found.to_coefficients)
    return MixedFit(
        beta, adjusted, freedom, found.undetermined(), found, variances, white[:, -1] - white[:, :-1] @ beta
    )


def _small_sample(s: _State, variances: Variances, T: Array) -> tuple[Array, Array]:
    """Covariance (p, p) and degrees of freedom (p,); in the whitened basis Φ is the identity."""
    _, _, A, Q = _derivatives(s.Py, s)
    W = variances.error
    K = range(len(A))
    bracket = sum((W[k, m] * (Q[k][m] - A[k] @ A[m]) for k in K for m in K), np.zeros_like(s.C))
    plain = T @ T.T
    adjusted = plain + 2.0 * T @ ((bracket + bracket.T) / 2.0) @ T.T
    g = np.array([np.einsum("pr,rs,ps->p", T, a, T) for a in A])
    spread = np.einsum("kp,km,mp->p", g, W, g)
    with np.errstate(divide="ignore", invalid="ignore"):
        freedom = np.where(spread > 0, 2.0 * np.diag(plain) ** 2 / spread, np.inf)
    return adjusted, freedom


def generalised_least_squares(y: Array, X: Array, effects: RandomEffects, theta: Array) -> Array:
    """β (p,) of y (n,) on X (n, p) with V(θ) given; of least scaled length where X does not determine it."""
    white = covariance(effects, theta).whiten(np.column_stack([X, y]))
    found = factors(white[:, :-1])
    return np.asarray(found.to_coefficients @ (found.basis.T @ white[:, -1]))
