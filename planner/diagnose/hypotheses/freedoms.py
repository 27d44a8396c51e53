"""Degrees of freedom of what columns of a pool test: by how well REML knows the variances they are made of.

    ν = 2 / (sᵀ F⁻¹ s),   s_k the share of variance k in the contrast's,  F⁻¹ their relative covariance

Source: F. E. Satterthwaite, Biometrics Bulletin 2 (1946) 110; of the shares: `noise.shares`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.noise.shares import degrees
from planner.nouns.array import Array

if TYPE_CHECKING:
    from planner.diagnose.hypotheses.pool import Pool, Taken


def satterthwaite(pool: Pool, axes: Iterable[int], k: NDArray[np.int64], R: Array) -> float:
    """2 / relative variance of what REML says of the variance of contrasts R (k, m) with Σ Rᵀ Gram R = 1.

    The columns' variance is made of those of white noise, of runs, …, each known as well as REML knows it.
    """
    beside: dict[int, Array] = {}
    if (t := pool.taken) is not None:
        R = t.left[k][:, None] * R
        beside = _by_blocks(pool, t, -(t.A[:, k] @ R))
    spread = 0.0
    for axis in axes:
        stand = {b: x for b, x in beside.items() if axis in pool.blocks[b].columns}
        at = np.searchsorted(pool.axes[axis], k)
        here = np.append(pool.axes[axis], -1)[at] == k
        share = pool.shares[axis].of_contrasts(at[here], R[here], stand)
        spread += float(share @ pool.state[axis].noise.relative_error @ share)
    return float(degrees(spread))


def of_each_column(pool: Pool) -> Array:
    """(K,) the same of every column by itself, at once: a search asks a pool for hundreds of them."""
    spread = np.zeros(len(pool.h))
    lengths = np.where(pool.squares > 0.0, 1.0 / np.sqrt(np.maximum(pool.squares, 1e-300)), 0.0)
    beside = {} if (t := pool.taken) is None else _by_blocks(pool, t, -(t.A * lengths))
    for axis, k in pool.axes.items():
        stand = {b: x[:, k] for b, x in beside.items() if axis in pool.blocks[b].columns}
        share = pool.shares[axis].of_each(lengths[k], stand)
        spread[k] += np.einsum("ik,ij,jk->k", share, pool.state[axis].noise.relative_error, share)
    return degrees(spread)


def _by_blocks(pool: Pool, t: Taken, of_taken: Array) -> dict[int, Array]:
    """Block that was taken -> (k_b, m) of (e, m), what contrasts are of the columns of all of them."""
    last = np.cumsum([len(pool.places[b]) for b in t.blocks])[:-1]
    return dict(zip(t.blocks, np.split(of_taken, last), strict=True))
