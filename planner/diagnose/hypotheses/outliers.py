"""Rows of a channel that are no readings of this campaign: spikes, a wrong file, a hand on the table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.campaign.channel_model import EXCITING
from planner.diagnose.hypotheses.channels import Channel
from planner.nouns.array import Array
from planner.solvers.least_squares import factors

FAR = 8.0  # sigma, beyond which a row is no reading of this campaign
FAR_WEIGHT = 1e-4  # of such a row: 40 sigma then count as 0.4
MOST_FAR = 0.02  # share of the rows; more are a structure, not accidents


def outliers(c: Channel, rich: Array, starts: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) rows that lie far off even where every candidate may bend; the worst when they are too many.

    All about the means of power-ons, whose spread is ten times that of the rows within one.
    """
    far = np.zeros(len(c.r), dtype=bool)
    if len(c.r) < 20:
        return far
    columns = np.column_stack([c.J, rich])
    for _ in range(4):
        left, freedom = _left(*_within(columns, c.r, starts, ~far), ~far)
        if freedom < (~far).sum() / 4.0:
            columns = c.J
            left, _ = _left(*_within(columns, c.r, starts, ~far), ~far)
        sigma = _sigma(left, c, starts)
        now = sigma > max(FAR, float(np.quantile(sigma, 1.0 - MOST_FAR)))
        if np.array_equal(now, far):
            break
        far = now
    return far


def _left(columns: Array, r: Array, seen: NDArray[np.bool_]) -> tuple[Array, float]:
    """(n,) what least squares over the rows seen leaves, at its full size, and the degrees of freedom."""
    found = factors(columns[seen], 1e-7)
    coefficients = found.to_coefficients @ (found.basis.T @ r[seen])
    share = np.einsum("nk,nk->n", found.basis, found.basis)
    left = r - columns @ coefficients
    left[seen] /= np.sqrt(1.0 - np.minimum(share, 0.97))
    return left, float(seen.sum() - share.sum())


def _within(
    columns: Array, r: Array, starts: NDArray[np.int64], seen: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """(n, k) columns and (n,) reading about their means over the rows seen of each power-on."""
    A = np.column_stack([columns, r])
    counts = np.add.reduceat(seen.astype(float), starts)
    means = np.add.reduceat(A * seen[:, None], starts) / np.maximum(counts, 1.0)[:, None]
    sizes = np.diff(np.append(starts, len(A)))
    A = A - np.repeat(np.where(sizes[:, None] > 2, means, 0.0), sizes, axis=0)
    return A[:, :-1], A[:, -1]


def _sigma(left: Array, c: Channel, starts: NDArray[np.int64]) -> Array:
    """(n,) robust sigma from the middle of the run; sigma grows with the input as the rows do."""
    sizes = np.diff(np.append(starts, len(left)))
    middle = np.array([np.median(part) for part in np.split(left, starts[1:])])
    about = np.where(np.repeat(sizes > 2, sizes), left - np.repeat(middle, sizes), left)
    size = np.abs(c.u)
    slow = size < 1.5 * EXCITING[c.sensor]
    rest = about[slow] if slow.sum() >= 20 else about
    spread = 1.4826 * float(np.median(np.abs(rest)))
    fast = ~slow & (size > 0)
    share = 1.4826 * float(np.median(np.abs(about[fast]) / size[fast])) if fast.sum() >= 10 else 0.0
    return np.asarray(np.abs(about) / np.maximum(np.hypot(spread, share * size), _least(c)))


def _least(c: Channel) -> float:
    """What a reading cannot be finer than: the step of its numbers, or rounding."""
    steps = np.diff(np.unique(c.y))
    step = float(np.min(steps[steps > 0], initial=np.inf))
    coarse = step if np.isfinite(step) and len(steps) < len(c.y) / 2 else 0.0
    return float(max(coarse / np.sqrt(12.0), 1e-12 * np.abs(c.y).max(initial=0.0)))
