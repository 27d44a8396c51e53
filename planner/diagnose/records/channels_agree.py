"""Whether several channels say the same coefficients of a reference, or one channel says its own.

    Δ_i = h_iᵀ G_i⁺ h_i   of each channel's own,   Δ = hᵀ G⁺ h,  G = Σ G_i, h = Σ h_i   of what they share

What their own explain beside what they share is chance, or a small part of it. Where nearly all is of one
channel it is that channel's, unless the others are sure of the same without it,

    Δ_o = h_oᵀ G_o⁺ h_o beyond chance,   2 γᵀ h_o − γᵀ G_o γ ≥ 0.8 Δ_o,   γ = G⁺ h,   o: Σ of the others

and no less than a tenth of all is theirs: less may be what the one channel's misfit makes of them. An
accelerometer that scatters less than the two others has four fifths of what a mounting of 0.2 deg explains,
and the others are sure of that mounting by fifty sigma.
"""

from __future__ import annotations

import numpy as np

from planner.diagnose.channels.told_directions import explained, inverse_of_told, rank
from planner.diagnose.records.size_within_power_ons import SEEN
from planner.nouns.array import Array
from planner.solvers.distributions import chi_square_tail

UNLIKE = 1e-3  # p of what the channels' leans explain beside what they share, above which they agree
OF_WHAT_IS_COMMON = 0.1  # which they may explain of a strong one: products that three angles miss
OF_ONE = 0.8  # of what the channels see: more by one alone is that channel's
CHANCE = 1e-5  # of what the others say, as of what all do


def agree(gram: Array, h: Array, s2: float) -> bool:
    """Whether channels (c, k, k), (c, k) share their coefficients. s2: of their noise"""
    G, g = gram.sum(axis=0), h.sum(axis=0)
    common = float(explained(G, g, SEEN)) / s2
    own = explained(gram, h, SEEN) / s2
    freedom = sum(rank(one, SEEN) for one in gram) - rank(G, SEEN)
    between = float(own.sum()) - common
    if freedom < 1:
        return False
    of_one = float(own.max() / max(own.sum(), 1e-300))
    if of_one > 1.0 - OF_WHAT_IS_COMMON:
        return False
    if of_one > OF_ONE and not _others_agree(gram, h, s2, int(np.argmax(own))):
        return False
    return between <= OF_WHAT_IS_COMMON * common or bool(chi_square_tail(between, freedom) > UNLIKE)


def _others_agree(gram: Array, h: Array, s2: float, one: int) -> bool:
    """Whether the channels but one are sure by themselves, and of what all say."""
    gamma = inverse_of_told(gram.sum(axis=0), SEEN) @ h.sum(axis=0)
    G, g = np.delete(gram, one, axis=0).sum(axis=0), np.delete(h, one, axis=0).sum(axis=0)
    theirs, by_all = float(explained(G, g, SEEN)), float(2.0 * gamma @ g - gamma @ G @ gamma)
    sure = rank(G, SEEN) > 0 and float(chi_square_tail(theirs / s2, rank(G, SEEN))) <= CHANCE
    return sure and by_all >= OF_ONE * theirs
