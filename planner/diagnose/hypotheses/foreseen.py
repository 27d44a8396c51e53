"""Whether a reference's coefficients are what nature has of it, and what the rest of the table says of them.

    γ̂ = G⁺ h,  cov γ̂ = G⁺ s²,    low − w σ ≤ γ̂ ≤ high + w σ

in whitened columns beside everything else that is believed. What a table lacks of the Earth's rate in turns
is what its rests have of it: other coefficients are an error of each gyro, the same on both ways of turning.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.pool import Pool, inverse
from planner.diagnose.hypotheses.scores import mean_square
from planner.nouns.array import Array

WIDE = 3.0  # sigma that chance may add to a bound
DETERMINED = 0.99  # of a coefficient's column that the others leave, below which it says nothing


def as_foreseen(pool: Pool, here: Pool, b: int) -> bool:
    """Whether every coefficient that the data tell lies within its bounds; here: the pool beside all else.

    Where a believed effect has taken a coefficient's column up, that effect is in its place.
    """
    bounds = pool.blocks[b].bounds
    if bounds is None:
        return True
    value, sigma, told = _coefficients(here, b)
    low, high = bounds
    within = (value >= low - WIDE * sigma) & (value <= high + WIDE * sigma)
    return bool(np.all(np.where(told, within, ~_coefficients(pool, b)[2])))


def _coefficients(pool: Pool, b: int) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Values (k,) and standard errors, SI, of a block's coefficients, and which of them the data tell."""
    k = pool.places[b]
    gram = pool.grams(k)
    cov = inverse(gram)
    told = (np.diag(cov @ gram) > DETERMINED) & (pool.size[k] > 0.0) & (np.diag(gram) > 0.0)
    size = np.where(told, pool.size[k], 1.0)
    sigma = np.sqrt(np.maximum(np.diag(cov), 0.0) * mean_square(pool, [b])) / size
    return (cov @ pool.h[k]) / size, sigma, told
