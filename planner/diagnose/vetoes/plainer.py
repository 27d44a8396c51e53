"""A table that follows no more than one coefficient's scatter from power-on to power-on is that coefficient.

A coefficient that is drawn anew at every power-on, if only by 2 % of itself, leaves more than noise about its
mean. A table has a value for every few power-ons, follows that, and its likelihood wins. So the table stands
beside the coefficient k with that scatter in the covariance,

    z = k s + C γ + e,   cov(e) = I + τ² Σ_runs s sᵀ,   τ² by restricted likelihood beside k and γ,

in whitened rows, s the coefficient's column and C the table's; F = Δ/m on m and n − m − 1, n power-ons that
tell k.

Nor is a name of several coefficients one that has another name within it, where they stand to each other as
the plainer one says. Each could have been anything up to its size: that it is not is a coincidence of one in
√Δ, log Δ of twice the log-likelihood. So the plainer name may leave that much for every coefficient less: at
two thousand sigma any name misses some, and whatever has more coefficients takes it up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.diagnose.hypotheses.found import ALIKE, SINGLE, Found, free
from planner.diagnose.hypotheses.pool import RANK, inverse
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.noise.whitened import log_p
from planner.diagnose.vetoes.verdicts import TAIL, is_table, per_power_on
from planner.nouns.array import Array

NEARLY = 0.9  # of what a table explains, from which one coefficient may be all there is of it
MISSED = 0.01  # of what a name explains, that one within it may leave: of less no coefficient is told apart
WITHIN = 1e-3  # of what a name explains, that one within it explains beside it at most


def plainer(found: Found, library: Sequence[int]) -> None:
    """Put a coefficient in the place of a believed table that is no more than its scatter.

    And a name in that of another that has it within and is no more.
    """
    _plainer_names(found, library)
    _coefficients_for_tables(found, library)


def _plainer_names(found: Found, library: Sequence[int]) -> None:
    for b in [b for b in found.library if not is_table(found, b) and not found.pool.blocks[b].reference]:
        c = _within(found, b, library) if b in found.library else None
        if c is not None:
            found.library[found.library.index(b)] = c
            _also_elsewhere(found, found.pool.blocks[b].name, found.pool.blocks[c].name, library)


def _coefficients_for_tables(found: Found, library: Sequence[int]) -> None:
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
            starts = here.state[min(found.axes(b))].noise.starts
            if _PowerOns(*per_power_on(here, [c, b], starts)).log_p_of_the_table() > np.log(SINGLE):
                found.library[found.library.index(b)] = c


def _within(found: Found, b: int, library: Sequence[int]) -> int | None:
    """The name within a believed one that explains it but for a coincidence; None: there is none."""
    here, whole = found.without(b), found.share(b)
    best: dict[int, float] = {}
    for c in free(found.pool, library, found.all) if whole.m > 1 else ():
        if found.axes(c) == found.axes(b) and not is_table(found, c):
            s = score(here, [c])
            missed = (whole.delta - s.delta) / whole.s2
            few = missed < min((whole.m - s.m) * np.log(whole.delta), MISSED * whole.delta)
            if 0 < s.m < whole.m and few and _is_within(found, c, whole.delta):
                best[c] = s.delta
    return max(best, key=lambda c: best[c], default=None)


def _also_elsewhere(found: Found, name: str, plain: str, library: Sequence[int]) -> None:
    """The plainer name where the other stood by what channels have in common (`Found.alike`)."""
    for b in [b for b in found.library if found.pool.blocks[b].name == name]:
        here = found.without(b)
        for c in free(found.pool, library, found.all):
            same = found.pool.blocks[c].name == plain and found.axes(c) == found.axes(b)
            if same and score(here, [c]).among_names + ALIKE >= score(here, [b]).among_names:
                found.library[found.library.index(b)] = c
                break


def _is_within(found: Found, c: int, explained: float) -> bool:
    """Whether a name says nothing of its own beside everything believed, which explains so much."""
    return score(found.without(), [c]).delta <= WITHIN * explained


@dataclass(frozen=True)
class _PowerOns:
    """Per power-on XᵀX (g, q, q) and Xᵀz (g, q) of X = [s, C]."""

    gram: Array
    h: Array

    def at(self, tau2: float) -> tuple[Array, Array]:
        """XᵀV⁻¹X and XᵀV⁻¹z (Sherman and Morrison, power-on by power-on)."""
        share = self._share(tau2)
        G = self.gram - share[:, None, None] * self.gram[:, :, :1] * self.gram[:, :1, :]
        h = self.h - share[:, None] * self.gram[:, :, 0] * self.h[:, :1]
        return G.sum(axis=0), h.sum(axis=0)

    def _share(self, tau2: float) -> Array:
        return np.asarray(tau2 / (1.0 + tau2 * self.gram[:, 0, 0]))

    def unlikely(self, tau2: float) -> float:
        """−2 log of the restricted likelihood, but for what does not depend on τ²."""
        G, h = self.at(tau2)
        values = np.linalg.eigvalsh(G)
        volume = float(np.sum(np.log1p(tau2 * self.gram[:, 0, 0])))
        volume += float(np.sum(np.log(values[values > RANK * values[-1]])))
        return volume - float(self._share(tau2) @ self.h[:, 0] ** 2) - float(h @ inverse(G) @ h)

    def log_p_of_the_table(self) -> float:
        """Of C beside s; 0 where too few power-ons tell s."""
        from scipy.optimize import minimize_scalar

        s = self.gram[:, 0, 0]
        largest = float(self.h[:, 0].sum() / s.sum()) ** 2  # scatter as large as the coefficient itself
        grid = largest * np.append(0.0, np.geomspace(1e-8, 1.0, 33))
        best = int(np.argmin([self.unlikely(t) for t in grid]))
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
        tau2 = float(minimize_scalar(self.unlikely, bounds=(low, high), method="bounded").x)
        G, h = self.at(tau2)
        m = int(np.linalg.matrix_rank(G, hermitian=True)) - 1
        freedom = int(np.sum(s > TAIL / len(s) * s.sum())) - m - 1
        if m < 1 or freedom < 1:
            return 0.0
        return float(log_p(h @ inverse(G) @ h - h[0] ** 2 / G[0, 0], m, freedom, 1.0))
