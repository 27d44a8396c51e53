"""Piecewise-linear tables by their segments: a coefficient is the rise from one node to the next.

    curve(x) = Σ_k c_k share_k(x),   share_k(x) = (x − x_(k−1)) / (x_k − x_(k−1)) within 0 … 1

The value at a node is the sum of the rises up to it. Where no record reached, the curve keeps its last value,
as a temperature table does; segments that the records passed over together share the rise. Values at the
nodes as coefficients would fall back to zero in both cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from planner.nouns.array import Array

WITHIN = 0.05  # share of a segment: nearer to its ends a record does not tell its slope


def shares(x: Array, nodes: Sequence[float]) -> Array:
    """(…, K) how far x (…) has come through each of the K segments between K + 1 nodes that rise: 0 … 1."""
    at = np.asarray(nodes, dtype=float)
    return np.asarray(np.clip((x[..., np.newaxis] - at[:-1]) / np.diff(at), 0.0, 1.0))


def segments_reached(x: Array, nodes: Sequence[float]) -> int:
    """In how many segments some x (n,) lies, further in than a share of it."""
    return sum(
        bool(np.any((x > low + WITHIN * (high - low)) & (x <= high * (1.0 + WITHIN))))
        for low, high in pairwise(nodes)
    )
