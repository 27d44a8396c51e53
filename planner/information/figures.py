"""The figure of a requirement, or whether it is kept, from the covariance that campaigns leave."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.information.in_flight import Asked
from planner.nouns.array import Array
from planner.solvers.length_share import length_within, variances_along, within


def figure_of(a: Asked, S: Array) -> Array:
    """(B, families) the largest figure over the instants: quantile of |d| or its root mean square."""
    if a.share is None:
        square = np.einsum("bfsicc->bfsi", S)
        each = square.max(axis=2) if a.weights is None else np.einsum("bfsi,s->bfi", square, a.weights)
        return np.asarray(np.sqrt(each.max(axis=2)))
    along, c = variances_along(np.moveaxis(S, 3, 2))
    return np.asarray(length_within(along, c, a.share, a.weights).max(axis=2))


def is_within(a: Asked, S: Array, most: Array) -> NDArray[np.bool_]:
    """(B, families) whether `figure_of` is at most (families,)."""
    if a.share is None:
        return np.asarray(figure_of(a, S) <= most)
    along, c = variances_along(np.moveaxis(S, 3, 2))
    each = within(along, c, most[:, None, None])
    share = each.min(axis=-1) if a.weights is None else each @ a.weights
    return np.asarray(share.min(axis=2) >= a.share)
