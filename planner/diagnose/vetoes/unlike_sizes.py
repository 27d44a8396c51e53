"""Whether power-ons differ in the size of a claimed effect by as much as it is: no constant of a sensor.

With γ̂ of all power-ons, C the columns clear of all else that is believed, z what is left, in white rows,

    aₖ = γ̂ᵀCₖᵀCₖγ̂,   sₖ = γ̂ᵀCₖᵀzₖ / aₖ,   m = Σ aₖ sₖ / Σ aₖ,   Q = Σ aₖ (sₖ − m)²
    τ² = (Q − (K − 1)) / (Σ aₖ − Σ aₖ² / Σ aₖ)     (DerSimonian, Laird, Control. Clin. Trials 7, 1986, 177)

sₖ is the size in power-on k, 1 on the average, τ its spread beyond noise. A sensor's effect may have a spread
of its own from power-on to power-on, of a part of itself; 46 single effects of campaigns of other people's
making had τ up to 0.31 of them, where noise explains all of it. A cable that is loose now and then had 0.7.

What was done otherwise on one bench, or from some power-on on, has its size there and nothing elsewhere. Of a
part A of the power-ons, B the others, m_A, m_B their means,

    Z² = (m_A − m_B)² / (1 / Σ_A aₖ + 1 / Σ_B aₖ)     of the part by which it is largest
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.found import Found
from planner.diagnose.hypotheses.pool import inverse
from planner.diagnose.vetoes.verdicts import TAIL, per_power_on
from planner.nouns.array import Array
from planner.solvers.distributions import chi_square_tail

MOST = 0.6  # τ, twice the largest of effects that are of one size
CHANCE = 1e-6  # of Q, by noise alone
NOTHING = 0.25  # of the other part's size, that what is not there may seem to have
APART = 5.0  # Z, of as many parts as there are power-ons
SHARE = 0.15  # of what all tell, that either part must
LEAST = 6  # power-ons that tell it: of fewer one that is off is a spread of its own kind


def sizes_differ(found: Found, b: int, starts: NDArray[np.int64], bench: NDArray[np.str_] | None) -> bool:
    """Whether the power-ons that tell a believed block do not agree on its size.

    starts: (g,) first rows; bench: (n,) of every row
    """
    gram, h = per_power_on(found.without(b), [b], starts)
    gamma = inverse(gram.sum(axis=0)) @ h.sum(axis=0)
    a, c = np.einsum("i,kij,j->k", gamma, gram, gamma), h @ gamma
    tells = a > TAIL / max(len(a), 1) * a.sum()
    a, c = a[tells], c[tells]
    if bench is not None and _of_a_part(a, c, _benches(bench[starts][tells])):
        return True
    if _of_a_part(a, c, _from_one_on(len(a))):
        return True
    if len(a) < LEAST or a.sum() ** 2 < LEAST * float(np.sum(a**2)):
        return False
    Q = float(np.sum((c - a * c.sum() / a.sum()) ** 2 / a))
    between = (Q - (len(a) - 1)) / float(a.sum() - np.sum(a**2) / a.sum())
    return bool(between > MOST**2 and chi_square_tail(Q, len(a) - 1) < CHANCE)


def _benches(bench: NDArray[np.str_]) -> NDArray[np.bool_]:
    """(parts, g) power-ons on each bench."""
    return np.array([bench == one for one in np.unique(bench)])


def _from_one_on(count: int) -> NDArray[np.bool_]:
    """(parts, g) power-ons from each one on but the first."""
    return np.tri(count, count, dtype=bool)[:-1]


def _of_a_part(a: Array, c: Array, parts: NDArray[np.bool_]) -> bool:
    """Whether one of the parts (p, g) has an effect that the other power-ons have not, or they and it not.

    a, c: (g,) information of each power-on, and what it says times that
    """
    known, said = parts @ a, parts @ c
    tells = (known > SHARE * a.sum()) & (known < (1.0 - SHARE) * a.sum())
    if not tells.any():
        return False
    known, said = known[tells], said[tells]
    here, there = said / known, (c.sum() - said) / (a.sum() - known)
    Z = np.abs(here - there) / np.sqrt(1.0 / known + 1.0 / (a.sum() - known))
    k = int(np.argmax(Z))
    least, most = sorted((abs(float(here[k])), abs(float(there[k]))))
    return bool(Z[k] > APART and least < NOTHING * most)
