"""A channel's noise under some columns and under a few more: what the likelihood says of each block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.noise import TOLD, Judged, Readings, judged_rows, least_freedom, roughly
from planner.diagnose.hypotheses.orthogonal import clear, orthonormal
from planner.nouns.array import Array
from planner.solvers.random_effects import covariance
from planner.solvers.reml_beside import Grounds


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
    def starts(self) -> NDArray[np.int64]:
        """(g,) first of these rows of every power-on."""
        return self.judged.sample.effects.starts

    def white(self) -> tuple[Array, Array]:
        """(n, p) the model's columns and (n,) the readings, whitened."""
        sample = self.judged.sample
        both = covariance(sample.effects, self.theta).whiten(np.column_stack([sample.basis, sample.y]))
        return both[:, :-1], both[:, -1]

    def whitened(self, columns: Array) -> Array:
        """V^(−1/2) of columns (n, k) of all the channel's rows, at the rows looked at."""
        rows, _ = judged_rows(self.judged.starts, len(columns))
        return covariance(self.judged.sample.effects, self.theta).whiten(columns[rows])

    def promises(self, blocks: Sequence[Array]) -> Array:
        """(2, k) what each of some blocks (n, m) would gain were its noise one scale of a law, less m log n.

            n log(|z|² / (|z|² − Δ)),   z what the model leaves, of the noise as it is, and of white noise

        What hides has made its own variance large: the noise as it is weighs rows lightly that tell it, white
        noise those of few power-ons too much. Either names it among the first.
        """
        sample = self.judged.sample
        rows, _ = judged_rows(self.judged.starts, len(blocks[0]))
        every = np.column_stack([sample.basis, sample.y, *(b[rows] for b in blocks)])
        v = covariance(sample.effects, self.theta)
        counts = [b.shape[1] for b in blocks]
        return np.array([_promises(law, self.columns, counts) for law in (v.whiten(every), every)])

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
        theta, found = roughly(wider, self.theta, self._grounds.with_columns(more))
        return Weighed(wider, theta, found) if np.isfinite(found) else None

    @cached_property
    def _grounds(self) -> Grounds:
        """From which models with a block more begin."""
        return Grounds(self.judged.sample, self.theta)


def _promises(white: Array, p: int, counts: Sequence[int]) -> list[float]:
    """Of columns (n, p + 1 + Σ counts): the model's, the readings, the blocks'."""
    n, found = len(white), []
    left = clear(orthonormal(white[:, :p]), white[:, p:])
    z = left[:, 0]
    total = float(z @ z)
    seen = np.sum(left**2, axis=0) > TOLD**2 * np.sum(white[:, p:] ** 2, axis=0)
    for first, last in pairwise(np.cumsum([1, *counts])):
        C = orthonormal(left[:, first:last][:, seen[first:last]], TOLD)
        rest = max(total - float(np.sum((C.T @ z) ** 2)), 1e-12 * total)
        found.append(n * float(np.log(total / rest)) - C.shape[1] * float(np.log(n)))
    return found


def weighed(readings: Readings) -> Weighed | None:
    """A channel under its own candidates; None where the rows tell no variance."""
    theta, found = readings.judged.at_first
    return Weighed(readings.judged, theta, found) if np.isfinite(found) else None
