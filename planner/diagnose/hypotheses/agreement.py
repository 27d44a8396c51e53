"""Whether the channels agree on what they are said to have in common: a reference is wrong for all of them.

The coefficients γ (k,) of several channels, each with estimates of its own, scatter about the common ones by

    Q = Σ_a hₐᵀ Gₐ⁺ hₐ − hᵀ G⁺ h,   hₐ = Cₐᵀzₐ,  Gₐ = CₐᵀCₐ,  h = Σ hₐ,  G = Σ Gₐ    (χ², Σ rank Gₐ − rank G)

in whitened columns C beside everything else that is believed. Source: Cochran, Biometrics 10 (1954) 101.

Where one channel tells most of it Q says little of the others. With γ̂ of that one and G, h of the others
together, these are to see E² = γ̂ᵀ G γ̂ and see γ̂ᵀh: nearer to nothing than to E², what is there is that
channel's own.
"""

from __future__ import annotations

import numpy as np

from planner.diagnose.channels.told_directions import explained, inverse_of_told, rank
from planner.diagnose.hypotheses.pool import Pool, inverse
from planner.nouns.array import Array
from planner.solvers.distributions import chi_square_tail

TOLD = 1e-3  # of the information, that a channel must have to be asked
TAKEN_UP = 0.1  # of what a channel would see of a reference, less of which an effect of its own leaves
UNLIKE = 1e-3  # p of Q, below which the channels differ
OF_OTHERS = 0.02  # of what one channel sees, below which the others see its products alone
SEVERAL = 2  # channels, fewer of which cannot disagree
WELL = 0.01  # of the best told direction's information
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
        h += C.T @ here.remainder(a)
    seen = int(np.linalg.matrix_rank(gram, hermitian=True)) if len(others) else 0
    return seen == 0 or bool(chi_square_tail(float(h @ inverse(gram) @ h), seen) > UNLIKE)


def channels_disagree(here: Pool, b: int, unlike: float) -> bool:
    """Whether the coefficients of several channels differ by more than a share of what they have in common.

    here: the pool beside all else; unlike: the share, Q over Δ of the common coefficients, which is what
    linear columns lack of a strong error
    """
    G, h = _each(here, b)
    told = np.array([np.trace(g) for g in G])
    G, h = G[told > TOLD * told.sum()], h[told > TOLD * told.sum()]
    if len(G) < SEVERAL:
        return False
    common = _explained(G.sum(axis=0), h.sum(axis=0))
    between = sum(_explained(g, x) for g, x in zip(G, h, strict=True)) - common
    freedom = sum(rank(g, WELL) for g in G) - rank(G.sum(axis=0), WELL)
    if between <= unlike * common or freedom < 1:
        return False
    return bool(chi_square_tail(between, freedom) < UNLIKE)


def others_have_their_own(pool: Pool, here: Pool, b: int) -> bool:
    """Whether what several channels would see of a block is taken up by what is believed of all but one.

    By what the one says of its coefficients γ: channel a would see γᵀ G_a γ of it in the pool, beside nothing
    that is believed. here: the pool beside all else
    """
    before, (G, h) = _each(pool, b)[0], _each(here, b)
    gamma = inverse_of_told(G.sum(axis=0), WELL) @ h.sum(axis=0)
    foreseen, left = (np.einsum("i,aij,j->a", gamma, g, gamma) for g in (before, G))
    see = foreseen > TOLD * foreseen.sum()
    return bool(np.sum(see) >= SEVERAL > np.sum(see & (left > TAKEN_UP * foreseen)))


def of_one_channel(here: Pool, b: int) -> bool:
    """Whether the others see nothing of what the channel that sees most of a block says of them."""
    G, h = _each(here, b)
    if len(G) < SEVERAL:
        return False
    most = int(np.argmax([_explained(g, x) for g, x in zip(G, h, strict=True)]))
    others = np.arange(len(G)) != most
    gamma = inverse_of_told(G[most], WELL) @ h[most]
    foreseen = float(gamma @ G[others].sum(axis=0) @ gamma)
    return foreseen > FORESEEN**2 and float(gamma @ h[others].sum(axis=0)) < 0.5 * foreseen


def seen_by_one(here: Pool, b: int) -> bool:
    """Whether all channels but the one that sees most of a block see nothing of it of their own.

    Products that linear columns lack of a strong effect of one channel are on the others as well.
    """
    channels = here.blocks[b].channels
    each = [_explained(g, h) for g, h in zip(*_each(here, b), strict=True)]
    most = int(np.argmax(each))
    return sum(each) - each[most] < OF_OTHERS * each[most] or rests_on(here, b, {channels[most]})


def explained_by_each(here: Pool, b: int) -> dict[int, float]:
    """Axis -> Δ of a block on that channel, by coefficients of its own."""
    return {a: _explained(g, h) for a, g, h in zip(here.blocks[b].columns, *_each(here, b), strict=True)}


def _each(here: Pool, b: int) -> tuple[Array, Array]:
    """G (channels, k, k) and h (channels, k) of every channel that sees a block."""
    k = here.places[b]
    columns = {a: here.seen(a, k) for a in here.blocks[b].columns}
    h = np.array([C.T @ here.remainder(a) for a, C in columns.items()])
    return np.array([C.T @ C for C in columns.values()]), h


def _explained(G: Array, h: Array) -> float:
    """Δ = hᵀ G⁺ h of the directions that are told well."""
    return float(explained(G, h, WELL))
