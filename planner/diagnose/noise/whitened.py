"""One channel after whitening: what the declared model leaves of it, and what nothing at all explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.noise.channel_noise import ChannelNoise
from planner.nouns.array import Array
from planner.solvers.group_batches import sums_of_groups
from planner.solvers.span import Span

SMALL = 0.5  # sigma, that a slope can amount to in all rows, below which it takes no degree of freedom
LEAST_TAIL = 1e-280  # of a double, whose smallest is 2e-308
A_COLUMN = 8  # rows for each column that is taken for what hides
STANDS_OUT = 1.5  # of what the largest column of noise explains
SEEN = 1e-5  # of a column's whitened length that must be left beside the declared model


@dataclass(frozen=True)
class Whitened:
    """One channel, whitened. Q: (n, q) declared model, fixed runs; z: (n,) residual clear of Q

    remainder: (n,) residual that neither a candidate nor a generic alternative explains, at its full size
    """

    channel: Channel
    noise: ChannelNoise
    Q: Array
    z: Array
    remainder: Array

    @cached_property
    def mean_square(self) -> float:
        """Of the residual of the full model: 1 when the noise model is right, more when it is too small."""
        return float(np.mean(self.remainder**2))

    def clear_of_declared(self, columns: Sequence[Array]) -> Cleared:
        """Some more columns (n, k) of the channel."""
        return _clear_of(self.channel, self.noise, self.Q, self.z, columns)


@dataclass(frozen=True)
class Cleared:
    """A channel's blocks, whitened and clear of its declared model. Q, z: as in Whitened

    columns: (n, k) of each block; left: (n, K) what is left of all; lengths: (K,) squares they had, whitened
    """

    channel: Channel
    noise: ChannelNoise
    Q: Array
    z: Array
    columns: Sequence[Array]
    left: Array
    lengths: Array

    def of(self, some: Sequence[Array]) -> Array:
        """(n, k) what is left of some blocks, or of columns of theirs; rounding is nothing left."""
        firsts = np.cumsum([0, *(x.shape[1] for x in self.columns)])
        places = {id(x): np.arange(*ends) for x, ends in zip(self.columns, pairwise(firsts), strict=True)}
        mine = [places[id(x)] for x in some if id(x) in places]
        k = np.concatenate([np.empty(0, dtype=np.int64), *mine])
        found = self.left[:, k[_squares(self.left)[k] > SEEN**2 * self.lengths[k]]]
        others = [_seen(self.Q, self.noise.whiten(x)) for x in some if id(x) not in places]
        return np.column_stack([found, *others])


def cleared(c: Channel, noise: ChannelNoise, columns: Sequence[Array]) -> Cleared:
    """The channel and all blocks that are asked of it, its declared model taken off; columns: (n, k) each."""
    white = noise.whiten(np.column_stack([c.r, c.J, noise.fixed_runs]))
    moves = np.append(_moves(c, white[:, 1 : c.J.shape[1] + 1]), np.full(noise.fixed_runs.shape[1], True))
    Q = orthonormal(white[:, 1:][:, moves])
    return _clear_of(c, noise, Q, clear(Q, white[:, 0]), columns)


def _clear_of(c: Channel, noise: ChannelNoise, Q: Array, z: Array, columns: Sequence[Array]) -> Cleared:
    every = noise.whiten(np.concatenate([np.empty((len(z), 0)), *columns], axis=1))
    return Cleared(c, noise, Q, z, columns, clear(Q, every), _squares(every))


def _squares(columns: Array) -> Array:
    """(k,) squared lengths of columns (n, k), which may be a tenth of a gigabyte: nothing is copied."""
    return np.asarray(np.einsum("nk,nk->k", columns, columns))


def whitened(known: Cleared, seen: Array) -> Whitened:
    """The channel, whitened, its declared model taken off; seen: (n, k) what is left of all candidates."""
    c, noise, Q, z = known.channel, known.noise, known.Q, known.z
    span = Span.of(seen, SEEN)
    if len(z) - Q.shape[1] - span.rank < len(z) / 4.0:
        span = Span.of(_largest(seen, z), SEEN)  # too few rows for all candidates at once
    n, g = len(z), len(noise.starts)
    taken = min(_between_rank(Q, noise.starts) + span.energy(of_means(span.X, noise.starts)), g - 1.0)
    between = max(1.0, g - taken)
    within = max(1.0, (n - g) - (Q.shape[1] + span.rank - taken))
    remainder = _full_size(clear(Q, span.clear(z)), noise.starts, between, within)
    less = float(np.mean(remainder**2))  # than the noise model says is chance: no reason to believe more
    return Whitened(c, noise, Q, z, remainder / np.sqrt(less) if 0.0 < less < 1.0 else remainder)


def moving(c: Channel, noise: ChannelNoise) -> NDArray[np.bool_]:
    """(q,) columns of the declared model whose largest coefficient is felt beside some noise."""
    return _moves(c, noise.whiten(c.J))


def _moves(c: Channel, white: Array) -> NDArray[np.bool_]:
    return np.asarray(np.linalg.norm(white, axis=0) >= SMALL / np.maximum(c.most, 1e-300))


def _seen(Q: Array, candidates: Array) -> Array:
    """(n, k') what is left of white candidates (n, k) beside a basis; rounding is no candidate."""
    left = clear(Q, candidates)
    return left[:, _squares(left) > SEEN**2 * _squares(candidates)]


def _largest(seen: Array, z: Array) -> Array:
    """(n, r) basis of the columns that stand out of what hides, taken one after the other.

    Orthogonal matching pursuit, as long as one explains more than the largest of so many columns of noise,
    2 log k (Donoho, Johnstone, Biometrika 81, 1994): else what hides would count as noise, and its flips
    look like it.
    """
    basis = np.empty((len(z), 0))
    least = SEEN * np.linalg.norm(seen, axis=0)
    for _ in range(len(z) // A_COLUMN):
        length = np.linalg.norm(seen, axis=0)
        sizes = np.where(length > least, (z @ seen) / np.maximum(length, 1e-300), 0.0)
        best = int(np.argmax(np.abs(sizes))) if len(sizes) else -1
        if best < 0 or sizes[best] ** 2 <= 2.0 * STANDS_OUT * np.log(len(sizes)):
            break
        u = seen[:, [best]] / length[best]
        basis = np.column_stack([basis, u])
        z, seen = clear(u, z), clear(u, seen)
    return basis


def _full_size(left: Array, starts: NDArray[np.int64], between: float, within: float) -> Array:
    """What the fit took from the means of runs and from within them is given back, each for itself."""
    n, g = len(left), len(starts)
    sizes = np.diff(np.append(starts, n))
    means = np.repeat(np.add.reduceat(left, starts) / sizes, sizes)
    inside = np.sqrt((n - g) / within) if n > g else 0.0
    return np.asarray(means * np.sqrt(g / between) + (left - means) * inside)


def _between_rank(R: Array, starts: NDArray[np.int64]) -> float:
    """How many differences between runs a basis takes up: the energy of its columns that is run means."""
    return float(np.sum(of_means(R, starts) ** 2))


def of_means(A: Array, starts: NDArray[np.int64]) -> Array:
    """(g, k) the means of runs of columns (n, k), each of the length that they have over its rows."""
    sizes = np.diff(np.append(starts, len(A)))
    return sums_of_groups(A, starts) / np.sqrt(sizes)[:, None]


def log_p(values: Array | float, m: Array | int, freedom: Array | float, s2: Array | float) -> Array:
    """log of the F test's p for Δ of m columns; never −∞. Of many Δ, or each with its m, freedom and s².

    P(F > x) = I_w(ν/2, m/2), w = ν / (ν + m x); where that underflows the first term of its series stands,
    w^(ν/2) / (ν/2 · B(ν/2, m/2)) (Abramowitz, Stegun 26.5.4).
    """
    from scipy.special import betainc, betaln

    values = np.asarray(values, dtype=float)
    if np.ndim(m) == 0 and m == 0:
        return np.zeros_like(values)
    half, columns = 0.5 * freedom, 0.5 * m
    grown = values / (s2 * freedom)
    tail = betainc(half, columns, 1.0 / (1.0 + grown))
    series = -half * np.log1p(grown) - np.log(half) - betaln(half, columns)
    return np.asarray(
        np.where(tail > LEAST_TAIL, np.log(np.maximum(tail, LEAST_TAIL)), np.minimum(series, 0.0))
    )
