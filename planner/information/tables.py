"""Tables over temperature for many campaigns at once: hats, nodes, places."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.temperature_table import REACH_K


def hats_of(temperature_degc: Array, nodes: Array) -> Array:
    """(B, X, N) weights of nodes (B, N) at temperatures (X,) or (B, X), as `hats` gives them.

    Nodes ascend; infinite ones, behind the others, are none and weigh nothing.
    """
    B, N = nodes.shape
    t = np.broadcast_to(temperature_degc, (B, np.shape(temperature_degc)[-1]))
    if N == 1:
        return np.ones((*t.shape, 1))
    t = np.clip(t, nodes[:, :1] - REACH_K, last_of(nodes) + REACH_K)
    spare = np.maximum(np.isfinite(nodes).sum(axis=1) - 2, 0)[:, None]
    left = np.clip((nodes[:, None, :] <= t[:, :, None]).sum(axis=2) - 1, 0, spare)
    place = left + N * np.arange(B)[:, None]
    low, high = nodes.take(place), nodes.take(place + 1)
    share = (t - low) / (high - low)  # a single node's next one is infinite: nothing
    found = np.zeros((*t.shape, N))
    flat = found.reshape(-1)
    place = left + N * np.arange(t.size).reshape(t.shape)
    flat[place], flat[place + 1] = 1.0 - share, share
    return found


def last_of(nodes: Array) -> Array:
    """(B, 1) the hottest of nodes (B, N), ascending, infinite where there are no more."""
    return np.asarray(np.max(nodes, axis=1, initial=-np.inf, where=np.isfinite(nodes))[:, None])


def nearest(points: Array, degc: Array) -> NDArray[np.intp]:
    """Where temperatures stand among points (N,), ascending: at the nearest, of two the lower."""
    if len(points) == 1:
        return np.zeros(np.shape(degc), dtype=np.intp)
    right = np.clip(np.searchsorted(points, degc), 1, len(points) - 1)
    nearer = degc - points[right - 1] <= points[right] - degc
    return np.asarray(np.where(nearer, right - 1, right))
