"""Whether the channels agree on what they are said to have in common: a reference is wrong for all of them.

One coefficient γ of several channels, each with an estimate of its own, scatters about the common one by

    Q = Σ_a hₐ² / gₐ − (Σ h)² / Σ g,   hₐ = Cₐᵀzₐ,  gₐ = CₐᵀCₐ     (χ² of one less than the channels)

in whitened columns C beside everything else that is believed. Source: Cochran, Biometrics 10 (1954) 101.

Where one channel tells most of it Q says little of the others. With γ̂ of that one and g, h of the others
together, these are to see E = γ̂ √g sigma and see O = h/√g: nearer to nothing than to E, what is there is that
channel's own.
"""

from __future__ import annotations

import numpy as np

from planner.diagnose.hypotheses.pool import Pool, inverse
from planner.nouns.array import Array
from planner.solvers.distributions import chi_square_tail

TOLD = 1e-3  # of the information, that a channel must have to be asked
UNLIKE = 1e-3  # p of Q, below which the channels differ
OF_WHAT_IS_COMMON = (
    0.5  # a strong one differs by what its linear shape lacks, a tenth of it: that is no reason
)


FORESEEN = 2.5  # sigma that the others are to see, from which they are asked: nine in ten then see half


def rests_on(here: Pool, b: int, axes: set[int]) -> bool:
    """Whether what several channels share is seen on some of them only: the others by themselves say nothing.

    Δ of the others' rows is χ² of their rank. here: beside all else
    """
    k, others = here.places[b], [a for a in here.blocks[b].columns if a not in axes]
    gram, h = np.zeros((len(k), len(k))), np.zeros(len(k))
    for a in others:
        C = here.seen(a, k)
        gram += C.T @ C
        h += C.T @ here.state[a].z
    rank = int(np.linalg.matrix_rank(gram, hermitian=True)) if len(others) else 0
    return rank == 0 or bool(chi_square_tail(float(h @ inverse(gram) @ h), rank) > UNLIKE)


def channels_disagree(here: Pool, b: int) -> bool:
    """Whether one coefficient of several channels is another one on each; here: beside all else."""
    g, h = _each(here, b)
    if not len(g):
        return False
    g, h = g[g > TOLD * g.sum()], h[g > TOLD * g.sum()]
    common = float(h.sum() ** 2 / g.sum())
    between = float(np.sum(h**2 / g)) - common
    return between > OF_WHAT_IS_COMMON * common and bool(chi_square_tail(between, len(g) - 1) < UNLIKE)


def of_one_channel(here: Pool, b: int) -> bool:
    """Whether the others see nothing of what the channel that sees most of a block says of them."""
    g, h = _each(here, b)
    if not len(g):
        return False
    g = np.maximum(g, 1e-300)
    most = int(np.argmax(h**2 / g))
    others = np.arange(len(g)) != most
    told = float(np.sqrt(g[others].sum()))
    foreseen = abs(float(h[most] / g[most])) * told
    return foreseen > FORESEEN and float(np.sign(h[most]) * h[others].sum()) < 0.5 * foreseen * told


def _each(here: Pool, b: int) -> tuple[Array, Array]:
    """g and h of every channel of a block with one coefficient; empty of another, or of one channel."""
    k = here.places[b]
    if len(k) != 1 or len(here.blocks[b].columns) < 2:
        return np.empty(0), np.empty(0)
    columns = {a: here.seen(a, k)[:, 0] for a in here.blocks[b].columns}
    h = np.array([C @ here.state[a].z for a, C in columns.items()])
    return np.array([C @ C for C in columns.values()]), h
