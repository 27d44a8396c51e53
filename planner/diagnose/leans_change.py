"""Whether a channel's leans become others at one power-on, by more than every power-on draws them anew.

    Δ = Σ_sides hᵀS⁺h − hᵀS⁺h (both),   S = OᵀO,  h = Oᵀe

O (n, 2) the other inputs and e (n,) what the reading is beyond its own, about the means of power-ons and
clear of a scale factor of each. Row by row a scale factor that every power-on draws, by 2e-5 of 300 deg/s,
makes any place the border of two units where each side has a few; leans are what two units never share. Δ is
held against what leans differ from power-on to power-on within a side: F on its columns and the power-ons'.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.whitened import log_p
from planner.nouns.array import Array

SEEN = 1e-4  # of the largest square of an input in a power-on, below which it tells nothing


def leans_change(y: Array, u: Array, axis: int, run: NDArray[np.int64], place: int) -> float:
    """log p of leans of channel `axis` that are the same before and after a power-on; 0 where none tells.

    y: (n,) reading, u: (n, 3) input, rows run by run; run: (n,) 0 … runs − 1; place: the last one before
    """
    starts = np.flatnonzero(np.append(True, np.diff(run) > 0))
    sizes = np.diff(np.append(starts, len(run)))
    own = u[:, axis]
    X = np.column_stack([own, np.delete(u, axis, axis=1), y - own])
    X = X - np.repeat(np.add.reduceat(X, starts) / sizes[:, None], sizes, axis=0)
    grams = np.array([part.T @ part for part in np.split(X, starts[1:])])
    least = SEEN * grams[:, [0, 1, 2], [0, 1, 2]].max()
    G, told = _clear_of_the_own(grams, least)
    each, dims = _explained(G, least)
    later = np.arange(len(G)) > place
    sides = np.array([G[~later].sum(axis=0), G[later].sum(axis=0)])
    split, ranks = _explained(sides, least)
    whole, rank = _explained(sides.sum(axis=0)[None], least)
    columns, freedom = int(ranks.sum() - rank[0]), int(dims.sum() - ranks.sum())
    rows = len(run) - len(G) - int(told.sum()) - int(dims.sum())
    if columns < 1 or freedom < 1 or rows < 1:
        return 0.0
    between = max(float(each.sum() - split.sum()), 0.0) / freedom
    within = max(float(G[:, 2, 2].sum() - each.sum()), 0.0) / rows
    gain = max(float(split.sum() - whole[0]), 0.0)
    return float(log_p(gain, columns, float(freedom), max(between, within, 1e-300)))


def _clear_of_the_own(grams: Array, least: float) -> tuple[Array, NDArray[np.bool_]]:
    """(g, 3, 3) products of the others and the rest, clear of the own input; (g,) where that is there."""
    own = grams[:, 0, 0]
    told = own > least
    along = grams[:, 0, 1:]
    share = np.where(told, 1.0 / np.where(told, own, 1.0), 0.0)
    return grams[:, 1:, 1:] - share[:, None, None] * along[:, :, None] * along[:, None, :], told


def _explained(G: Array, least: float) -> tuple[Array, NDArray[np.int64]]:
    """(g,) square of the rest that regression on the others explains, and how many columns tell it."""
    value, vector = np.linalg.eigh(G[:, :2, :2])
    seen = value > least
    along = np.einsum("gij,gi->gj", vector, G[:, :2, 2])
    return np.sum(np.where(seen, along**2 / np.where(seen, value, 1.0), 0.0), axis=1), seen.sum(axis=1)
