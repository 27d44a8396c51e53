"""Whether a few records, each off by itself, explain what a block of columns explains.

A block of many columns follows struck records: in a power-on of three, two of which candidates may bend, no
row looks far. Asked is the same criterion of both,

    Δ/s² − m log(freedom)   against   Δ_r/s² − 2 r log n,

r records taken greedily (orthogonal matching pursuit: Pati, Rezaiifar, Krishnaprasad 1993), each of which
costs its own size and the choice of one of n.
"""

from __future__ import annotations

import numpy as np

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.hypotheses.found import Found
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.hypotheses.scores import mean_square, score
from planner.nouns.array import Array

MOST = 6  # records: more of them are a structure
COLUMNS = 2  # of the block for each record: an equation of one coefficient cannot follow records
TRIED = 24  # of the largest residuals
KEPT = 0.5  # share of its Δ, from which a block stands beside the records
TOLD = 1e-3  # of a record's whitened length that must be left beside the declared model


def a_few_records_explain(found: Found, b: int) -> bool:
    """Whether at most MOST records of the block's channels are the better explanation of what it explains.

    A block of few columns cannot follow them and is not asked. Struck records elsewhere explain much as well:
    beside those taken the block must have lost its share.
    """
    here = found.without(b)
    block, s2 = score(here, [b]), mean_square(here, [b])
    both = [_records(found, here, b, axis) for axis in here.blocks[b].columns]
    most = min(MOST, block.m // COLUMNS)
    told = np.cumsum(np.sort(np.concatenate([np.empty(0), *(gains for gains, _ in both)]))[::-1][:most]) / s2
    count = 1.0 + np.arange(len(told))
    rows = sum(len(here.state[axis].z) for axis in here.blocks[b].columns)
    better = np.any(told - 2.0 * count * np.log(rows) > block.criterion)
    return bool(better and sum(left for _, left in both) < KEPT * block.delta)


def _records(found: Found, here: Pool, b: int, axis: int) -> tuple[Array, float]:
    """(r,) what each of the best records explains beside those before it; what the block does beside all."""
    w = here.state[axis]
    parts = here.parts[axis]
    others = np.isin(here.axes[axis], here.columns(found.others(b)))
    E = orthonormal(parts[:, others]) if others.any() else np.empty((len(w.z), 0))
    z, C = clear(E, w.z), clear(E, parts[:, np.isin(here.axes[axis], here.places[b])])
    tried = np.argsort(-np.abs(z))[:TRIED]
    one = np.zeros((len(z), len(tried)))
    one[tried, np.arange(len(tried))] = 1.0
    white = w.noise.whiten(one)
    U = clear(E, clear(w.Q, white))
    gains = []
    least = TOLD * np.linalg.norm(white, axis=0)
    for _ in range(MOST):
        length = np.linalg.norm(U, axis=0)
        unit = np.where(length > least, U / np.maximum(length, 1e-300), 0.0)
        sizes = unit.T @ z
        best = int(np.argmax(np.abs(sizes)))
        u = unit[:, best]
        gains.append(float(sizes[best] ** 2))
        z = z - u * sizes[best]
        U, C = U - np.outer(u, u @ U), C - np.outer(u, u @ C)
    return np.array(gains), float(np.sum((orthonormal(C, 1e-6).T @ z) ** 2))
