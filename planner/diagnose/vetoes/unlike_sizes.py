"""Whether power-ons differ in the size of a claimed effect by as much as it is: no constant of a sensor.

With γ̂ of all power-ons, C the columns clear of all else that is believed, z what is left, in white rows,

    aₖ = γ̂ᵀCₖᵀCₖγ̂,   sₖ = γ̂ᵀCₖᵀzₖ / aₖ,   m = Σ aₖ sₖ / Σ aₖ,   Q = Σ aₖ (sₖ − m)²
    τ² = (Q − (K − 1)) / (Σ aₖ − Σ aₖ² / Σ aₖ)     (DerSimonian, Laird, Control. Clin. Trials 7, 1986, 177)

sₖ is the size in power-on k, 1 on the average, τ its spread beyond noise. A sensor's effect may have a spread
of its own from power-on to power-on, of a part of itself; 46 single effects of campaigns of other people's
making had τ up to 0.31 of them, where noise explains all of it. A cable that is loose now and then had 0.7.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.found import Found
from planner.diagnose.hypotheses.pool import inverse
from planner.diagnose.vetoes.verdicts import TAIL, per_power_on
from planner.solvers.distributions import chi_square_tail

MOST = 0.6  # τ, twice the largest of effects that are of one size
CHANCE = 1e-6  # of Q, by noise alone
LEAST = 6  # power-ons that tell it: of fewer one that is off is a spread of its own kind


def sizes_differ(found: Found, b: int, starts: NDArray[np.int64]) -> bool:
    """Whether the power-ons that tell a believed block do not agree on its size. starts: (g,) first rows."""
    gram, h = per_power_on(found.without(b), [b], starts)
    gamma = inverse(gram.sum(axis=0)) @ h.sum(axis=0)
    a, c = np.einsum("i,kij,j->k", gamma, gram, gamma), h @ gamma
    tells = a > TAIL / max(len(a), 1) * a.sum()
    a, c = a[tells], c[tells]
    if len(a) < LEAST or a.sum() ** 2 < LEAST * float(np.sum(a**2)):
        return False
    Q = float(np.sum((c - a * c.sum() / a.sum()) ** 2 / a))
    between = (Q - (len(a) - 1)) / float(a.sum() - np.sum(a**2) / a.sum())
    return bool(between > MOST**2 and chi_square_tail(Q, len(a) - 1) < CHANCE)
