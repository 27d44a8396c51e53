"""A table that follows no more than one coefficient's scatter from power-on to power-on is that coefficient.

A coefficient that is drawn anew at every power-on, if only by 2 % of itself, leaves more than noise about its
mean. A table has a value for every few power-ons, follows that, and its likelihood wins. So the table stands
beside the coefficient k with that scatter in the covariance,

    z = k s + C γ + e,   cov(e) = I + τ² Σ_runs s sᵀ,   τ² by restricted likelihood beside k and γ,

in whitened rows, s the coefficient's column and C the table's; F = Δ/m on m and n − m − 1, n power-ons that
tell k.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.diagnose.hypotheses.found import SINGLE, Found, free
from planner.diagnose.hypotheses.pool import RANK, Pool, inverse, score
from planner.diagnose.hypotheses.verdicts import TAIL, is_table
from planner.nouns.array import Array

NEARLY = 0.9  # of what a table explains, from which one coefficient may be all there is of it


def plainer(found: Found, library: Sequence[int]) -> None:
    """Put a coefficient in the place of a believed table that is no more than its scatter."""
    for b in [b for b in found.library if is_table(found, b)]:
        here, whole = found.without(b), found.share(b).delta
        plain = {}
        for c in free(found.pool, library, found.all):
            if found.axes(c) == found.axes(b) and not is_table(found, c):
                s = score(here, [c])
                if s.m == 1 and s.delta >= NEARLY * whole:
                    plain[c] = s.delta
        if plain:
            c = max(plain, key=lambda c: plain[c])
            if _runs(here, c, b).p_of_the_table() > SINGLE:
                found.library[found.library.index(b)] = c


@dataclass(frozen=True)
class _Runs:
    """Per power-on XᵀX (g, q, q), Xᵀz (g, q) and zᵀz (g,) of X = [s, C]."""

    gram: Array
    h: Array
    square: Array

    def at(self, tau2: float) -> tuple[Array, Array, float, float]:
        """XᵀV⁻¹X, XᵀV⁻¹z, zᵀV⁻¹z and log |V| (Sherman and Morrison, power-on by power-on)."""
        s = self.gram[:, 0, 0]
        share = tau2 / (1.0 + tau2 * s)
        G = self.gram - share[:, None, None] * self.gram[:, :, :1] * self.gram[:, :1, :]
        h = self.h - share[:, None] * self.gram[:, :, 0] * self.h[:, :1]
        square = float(np.sum(self.square - share * self.h[:, 0] ** 2))
        return G.sum(axis=0), h.sum(axis=0), square, float(np.sum(np.log1p(tau2 * s)))

    def unlikely(self, tau2: float) -> float:
        """−2 log of the restricted likelihood."""
        G, h, square, size = self.at(tau2)
        values = np.linalg.eigvalsh(G)
        return (
            square
            - float(h @ inverse(G) @ h)
            + size
            + float(np.sum(np.log(values[values > RANK * values[-1]])))
        )

    def p_of_the_table(self) -> float:
        """Of C beside s; 1 where too few power-ons tell s."""
        from scipy.optimize import minimize_scalar
        from scipy.stats import f

        s = self.gram[:, 0, 0]
        largest = float(self.h[:, 0].sum() / s.sum()) ** 2  # scatter as large as the coefficient itself
        grid = largest * np.append(0.0, np.geomspace(1e-8, 1.0, 33))
        best = int(np.argmin([self.unlikely(t) for t in grid]))
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
        tau2 = float(minimize_scalar(self.unlikely, bounds=(low, high), method="bounded").x)
        G, h, _, _ = self.at(tau2)
        m = int(np.linalg.matrix_rank(G, hermitian=True)) - 1
        tell = int(np.sum(s > TAIL / len(s) * s.sum()))
        if m < 1 or tell - m - 1 < 1:
            return 1.0
        delta = float(h @ inverse(G) @ h) - float(h[0] ** 2 / G[0, 0])
        return float(f.sf(delta / m, m, tell - m - 1))


def _runs(here: Pool, c: int, b: int) -> _Runs:
    """The rows of the channels of both, clear of all that is declared and believed, power-on by power-on."""
    k = [*np.asarray(here.places[c]), *np.asarray(here.places[b])]
    gram, h, square = None, None, None
    for axis in here.blocks[b].columns:
        w, starts = here.state[axis], here.state[axis].noise.starts
        X = here.parts[axis] @ here.beside[here.axes[axis]][:, k]
        own = (
            np.add.reduceat(X[:, :, None] * X[:, None, :], starts),
            np.add.reduceat(X * w.z[:, None], starts),
            np.add.reduceat(w.z**2, starts),
        )
        gram, h, square = own if gram is None else (gram + own[0], h + own[1], square + own[2])
    assert gram is not None
    assert h is not None
    assert square is not None
    return _Runs(gram, h, square)
