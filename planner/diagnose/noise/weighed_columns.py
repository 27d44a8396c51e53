"""A channel's noise under some columns and under a few more: what the likelihood says of each block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.noise.channel_noise import ROUGHLY, TOLD, Judged, Readings, judged_rows, least_freedom
from planner.diagnose.noise.whitened import of_means
from planner.nouns.array import Array
from planner.solvers.block_covariance import BlockCovariance
from planner.solvers.least_squares import orthogonal
from planner.solvers.random_effects import Covariance, covariance
from planner.solvers.reml_beside import Grounds, Rough, reml_roughly
from planner.solvers.restricted_likelihood import loglik

BETWEEN = 0.9  # of the square of columns that is the power-ons' means: they differ between these alone


@dataclass(frozen=True)
class Weighed:
    """A channel's noise under some columns. loglik: of the rows at its variances, theta (K,)."""

    judged: Judged
    theta: Array
    loglik: float

    @property
    def columns(self) -> int:
        """How many columns the model has."""
        return int(self.judged.sample.basis.shape[1])

    @property
    def rows(self) -> int:
        """How many rows were looked at."""
        return len(self.judged.sample.y)

    @property
    def criterion(self) -> float:
        """2 log L less log n for every column and variance: by which unlike models compare (Schwarz)."""
        return 2.0 * self.loglik - float(self.columns + len(self.theta)) * float(np.log(self.rows))

    def told_by(self, columns: Array) -> float:
        """log n of what tells columns (n, k), each of which costs that: the rows, or the power-ons.

        Of what differs only between power-ons as many of these say something, however many rows each has
        (Pauler, Biometrika 85, 1998, 13; Jones, Statistics in Medicine 30, 2011, 3050).
        """
        return float(self._costs(self._at_rows(columns), [columns.shape[1]])[0])

    def _costs(self, asked: Array, counts: Sequence[int]) -> Array:
        """(k,) `told_by` of blocks side by side (n, Σ counts), at the rows looked at."""
        mean = len(asked) * np.mean(asked, axis=0) ** 2
        squares = np.einsum("nk,nk->k", asked, asked) - mean
        between = np.sum(of_means(asked, self.starts) ** 2, axis=0) - mean
        firsts = np.cumsum([0, *counts])[:-1]
        alone = np.add.reduceat(between, firsts) > BETWEEN * np.add.reduceat(squares, firsts)
        return np.asarray(np.where(alone, np.log(len(self.starts)), np.log(self.rows)), dtype=float)

    @property
    def starts(self) -> NDArray[np.int64]:
        """(g,) first of these rows of every power-on."""
        return self.judged.sample.effects.starts

    @cached_property
    def white(self) -> tuple[Array, Array]:
        """(n, p) the model's columns and (n,) the readings, whitened."""
        sample = self.judged.sample
        both = self._v.whiten(np.column_stack([sample.basis, sample.y]))
        return both[:, :-1], both[:, -1]

    @cached_property
    def basis(self) -> Array:
        """(n, p) orthonormal, of the whitened columns, which are all told apart."""
        return orthogonal(self.white[0])[0]

    @cached_property
    def left(self) -> Array:
        """(n,) the whitened readings without what the columns explain."""
        return clear(self.basis, self.white[1][:, None])[:, 0]

    def whitened(self, columns: Array) -> Array:
        """V^(−1/2) of columns (n, k) of all the channel's rows, at the rows looked at."""
        return self._v.whiten(self._at_rows(columns))

    def explained(self, declared: Array) -> float:
        """Squares of sigma that the model explains beside declared columns (n, q) (n, q), some of its own."""
        own = orthonormal(self.whitened(declared), TOLD)
        y = self.white[1]
        return float(np.sum((self.basis.T @ y) ** 2) - np.sum((own.T @ y) ** 2))

    @cached_property
    def _v(self) -> Covariance | BlockCovariance:
        return covariance(self.judged.sample.effects, self.theta)

    def _at_rows(self, columns: Array) -> Array:
        rows, _ = judged_rows(self.judged.starts, len(columns))
        return columns[rows]

    def promises(self, blocks: Sequence[Array]) -> Array:
        """(2, k) what each of some blocks (n, m) would gain were its noise one scale of a law, less m log n.

            n log(|z|² / (|z|² − Δ)),   z what the model leaves, of the noise as it is, and of white noise

        What hides has made its own variance large: the noise as it is weighs rows lightly that tell it, white
        noise those of few power-ons too much. Either names it among the first.
        """
        sample, counts = self.judged.sample, [b.shape[1] for b in blocks]
        asked = self._at_rows(np.column_stack(blocks))
        costs = self._costs(asked, counts)
        laws = (
            (self.basis, self.left, self._v.whiten(asked)),
            (sample.basis, sample.left, asked),
        )
        return np.array([_promises(Q, z, columns, counts, costs) for Q, z, columns in laws])

    def beside(self, block: Array) -> Weighed | None:
        """The same with a block (n, k) more; None where the rows do not carry it, or it is nothing more."""
        sample = self.judged.sample
        rows, firsts = judged_rows(self.judged.starts, len(block))
        seen = block[rows]
        left = clear(sample.basis, seen)
        told = np.sum(left**2, axis=0) > TOLD**2 * np.sum(seen**2, axis=0)
        more = orthonormal(left[:, told], TOLD)
        basis = np.column_stack([sample.basis, more])
        if not more.size or len(rows) - basis.shape[1] < least_freedom(firsts):
            return None
        wider = replace(self.judged, sample=replace(sample, X=basis))
        first = self._grounds.with_columns(more)
        theta, found = _believed(wider, reml_roughly(wider.sample, self.theta, ROUGHLY, first))
        return Weighed(wider, theta, found) if np.isfinite(found) else None

    @cached_property
    def _grounds(self) -> Grounds:
        """From which models with a block more begin."""
        return Grounds(self.judged.sample, self.theta)


def _promises(Q: Array, z: Array, asked: Array, counts: Sequence[int], costs: Array) -> Array:
    """(k,) of blocks' columns (n, Σ counts) beside a basis, z (n,) what that leaves of the readings.

    costs: (k,) of each column of a block

    By products of each block's columns of length one, blocks of one width at a time: which blocks are asked
    for their likelihood needs no more digits.
    """
    n, widths = len(z), np.array(counts)
    left = clear(Q, asked)
    total, square = float(z @ z), np.sum(left**2, axis=0)
    seen = square > TOLD**2 * np.sum(asked**2, axis=0)
    left *= np.where(seen, 1.0 / np.sqrt(np.where(seen, square, 1.0)), 0.0)
    h, firsts = z @ left, np.cumsum([0, *counts[:-1]])
    explained, rank = np.zeros(len(widths)), np.zeros(len(widths))
    for width in set(counts):
        mine = np.flatnonzero(widths == width)
        at = firsts[mine, None] + np.arange(width)
        blocks = left[:, at].transpose(1, 2, 0)
        value, vector = np.linalg.eigh(blocks @ blocks.transpose(0, 2, 1))
        told = value > np.maximum(TOLD**2 * value[:, -1:], 1e-300)
        along = np.einsum("bij,bi->bj", vector, h[at]) ** 2
        explained[mine] = np.sum(np.where(told, along / np.where(told, value, 1.0), 0.0), axis=1)
        rank[mine] = told.sum(axis=1)
    rest = np.maximum(total - explained, 1e-12 * total)
    return np.asarray(n * np.log(total / rest) - rank * costs)


def weighed(readings: Readings) -> Weighed | None:
    """A channel under its own candidates; None where the rows tell no variance."""
    judged = readings.judged
    theta, found = _believed(judged, judged.rough)
    return Weighed(judged, theta, found) if np.isfinite(found) else None


def _believed(j: Judged, found: Rough) -> tuple[Array, float]:
    """θ (K,), none of it less than may be believed, and the log-likelihood of the rows there."""
    if (found.theta < j.least).any():
        theta = np.maximum(found.theta, j.least)
        return theta, loglik(j.sample, theta)
    return found.theta, found.of_the_rows
