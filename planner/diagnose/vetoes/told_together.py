"""Coefficients that some records tell only together: those are asked that say it by themselves.

A unit that was on an arm one way up only gives way to the same side of itself and of the arm. The columns of
`arm` and `face` are then the same beside the declared model, neither has an interval, and nothing would stand
of an effect that explains all there is. Nor of products of two inputs at rest, where |f|² = g² makes three
squares and the bias one: of coefficients of which each may be the only one, the fewest are asked that tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.found import Found
from planner.diagnose.hypotheses.pool import Pool, extended, inverse

LEAST = 20.0  # sigma, of an effect that cannot be nothing; a rounding of readings without noise is 8
APART = 1e-6  # of a column's square, less of which beside the others before it tells nothing of its own


def told_together(found: Found, cuts: NDArray[np.int64]) -> None:
    """Every believed effect that several channels share, or of one that may have any of its coefficients.

    With the columns alone that are its own.
    """
    for i, b in enumerate(found.library):
        block = found.pool.blocks[b]
        shared = len(block.columns) > 1
        if block.reference or len(block.terms) < 2 or not (shared or block.apart):
            continue
        own = _own(found.pool, found.pool.places[b])
        if len(own) < len(block.terms) and (not shared or found.share(b).delta > LEAST**2):
            own = own if shared else _fewest(found.without(b), found.pool.places[b])
            columns = {axis: x[:, own] for axis, x in block.columns.items()}
            fewer = replace(block, columns=columns, terms=tuple(block.terms[k] for k in own), apart=False)
            found.pool = extended(found.pool, fewer, cuts)
            new = len(found.pool.blocks) - 1
            found.library[i] = new
            if b in found.p:
                found.p[new] = found.p[b]


def _own(pool: Pool, k: NDArray[np.int64]) -> Sequence[int]:
    """Which of a block's columns are not those before it, in its order."""
    G = pool.grams(k)
    kept: list[int] = []
    for i in range(len(k)):
        along = G[np.ix_(kept, [i])][:, 0]
        left = G[i, i] - along @ np.linalg.pinv(G[np.ix_(kept, kept)], hermitian=True) @ along
        if left > APART * G[i, i] and G[i, i] > 0.0:
            kept.append(i)
    return kept


def _fewest(here: Pool, k: NDArray[np.int64]) -> Sequence[int]:
    """Which of a block's columns explain it, the best first, each by more than the criterion asks of it."""
    kept: list[int] = []
    G, h = here.grams(k), here.h[k]
    price = float(np.log(max(len(next(iter(here.state.values())).z), 3)))
    explained = 0.0
    while len(kept) < len(k):
        tried = ([*kept, i] for i in range(len(k)) if i not in kept and G[i, i] > 0.0)
        gains = {i[-1]: float(h[i] @ inverse(G[np.ix_(i, i)]) @ h[i]) for i in tried}
        best = max(gains, key=lambda i: gains[i], default=None)
        if best is None or (kept and gains[best] - explained < price):
            break
        kept.append(best)
        explained = gains[best]
    return sorted(kept)
