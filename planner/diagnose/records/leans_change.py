"""Whether a channel's leans become others at one power-on, by more than every power-on draws them anew.

    Δ = Σ_sides hᵀS⁺h − hᵀS⁺h (both),   S = OᵀO,  h = Oᵀe

O (n, 2) the other inputs and e (n,) what the reading is beyond its own, about the means of power-ons and
clear of a scale factor of each. Row by row a scale factor that every power-on draws, by 2e-5 of 300 deg/s,
makes any place the border of two units where each side has a few; leans are what two units never share. Δ is
held against what leans differ from power-on to power-on within a side: F on its columns and the power-ons'.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.noise.whitened import log_p
from planner.nouns.array import Array

SEEN = 1e-4  # of the largest square of an input in a power-on, below which it tells nothing


@dataclass(frozen=True)
class Leans:
    """What each of g power-ons says of a channel's two leans.

    gram: (g, 3, 3) products of the other inputs and the rest; least: square from which one tells something
    each, dims: (g,) what leans of its own explain of it, and how many; rows: degrees of freedom within
    """

    gram: Array
    least: float
    each: Array
    dims: NDArray[np.int64]
    rows: int

    @property
    def within(self) -> float:
        """Square a row that leans of each power-on leave."""
        return max(float(self.gram[:, 2, 2].sum() - self.each.sum()), 0.0) / max(self.rows, 1)


def leans_of_each(y: Array, u: Array, axis: int, run: NDArray[np.int64]) -> Leans:
    """What the power-ons say, one by one; the arguments of `leans_change`."""
    starts = np.flatnonzero(np.append(True, np.diff(run) > 0))
    sizes = np.diff(np.append(starts, len(run)))
    own = u[:, axis]
    X = np.column_stack([own, np.delete(u, axis, axis=1), y - own])
    X = X - np.repeat(np.add.reduceat(X, starts) / sizes[:, None], sizes, axis=0)
    grams = np.array([part.T @ part for part in np.split(X, starts[1:])])
    least = SEEN * grams[:, [0, 1, 2], [0, 1, 2]].max()
    G, told = _clear_of_the_own(grams, least)
    each, dims = _explained(G, least)
    return Leans(G, float(least), each, dims, len(run) - len(G) - int(told.sum()) - int(dims.sum()))


def leans_change(y: Array, u: Array, axis: int, run: NDArray[np.int64]) -> Array:
    """(runs − 1,) log p of leans of channel `axis` that are the same before and after each power-on.

    0 where none tells. y: (n,) reading, u: (n, 3) input, rows run by run; run: (n,) 0 … runs − 1; the last
    power-on before is each but the last.
    """
    x = leans_of_each(y, u, axis, run)
    G, least, each, dims = x.gram, x.least, x.each, x.dims
    total, before = G.sum(axis=0), np.cumsum(G, axis=0)[:-1]
    first, last = _explained(before, least), _explained(total - before, least)
    split, ranks = first[0] + last[0], first[1] + last[1]
    whole, rank = _explained(total[None], least)
    columns, freedom = ranks - rank[0], int(dims.sum()) - ranks
    between = np.maximum(each.sum() - split, 0.0) / np.maximum(freedom, 1)
    gain = np.maximum(split - whole[0], 0.0)
    found = np.zeros(len(split))
    for k in np.flatnonzero((columns > 0) & (freedom > 0) & (x.rows > 0)).tolist():
        s2 = max(float(between[k]), x.within, 1e-300)
        found[k] = float(log_p(float(gain[k]), int(columns[k]), float(freedom[k]), s2))
    return found


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
