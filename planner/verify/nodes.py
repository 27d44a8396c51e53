"""Temperature tables: where their nodes lie, how they are read, and how a fit sees them."""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array

REACH_K = 5.0  # a table's end segments go on so far; beyond, it is constant
APART_K = 3.0  # records closer than this in temperature belong to one node
SWEEP_K = 10.0  # spacing of nodes where the temperature was swept through
_FEW = 8


def nodes_of(temperature_degc: Array) -> Array:
    """(N,) the medians of the clusters of temperatures (n,); a sweep gets evenly spaced nodes.

    Among eight records or more a cluster of one is no node.
    """
    t = np.sort(temperature_degc)
    found: list[float] = []
    for cluster in np.split(t, np.flatnonzero(np.diff(t) > APART_K) + 1):
        low, high = np.percentile(cluster, [0.5, 99.5])
        if len(cluster) < 2 and len(t) >= _FEW:
            continue
        if high - low <= 2.0 * APART_K:
            found.append(float(np.median(cluster)))
        else:
            found += np.linspace(low, high, max(2, int(np.ceil((high - low) / SWEEP_K)) + 1)).tolist()
    return np.array(found or [float(np.median(t))])


def visited(nodes: Array, temperature_degc: Array) -> Array:
    """The nodes that are the nearest one of some temperature; all of them when there is none."""
    if len(temperature_degc) == 0:
        return nodes
    apart = np.abs(temperature_degc[:, None] - nodes)
    return np.asarray(nodes[np.unique(np.argmin(apart, axis=1))])


def read(temperature_degc: Array, nodes: Array) -> Array:
    """(..., N) what each node counts at temperatures (...): straight lines between nodes."""
    if len(nodes) == 1:
        return np.ones((*np.shape(temperature_degc), 1))
    t = np.minimum(np.maximum(temperature_degc, nodes[0] - REACH_K), nodes[-1] + REACH_K)
    left = np.searchsorted(nodes[1:-1], t, side="right")
    share = ((t - nodes[left]) / np.diff(nodes)[left])[..., None]
    one = np.eye(len(nodes))
    return np.asarray((1.0 - share) * one[left] + share * one[left + 1])


def fitted(temperature_degc: Array, nodes: Array) -> Array:
    """(n, N) what each node counts in a fit of records at temperatures (n,).

    About a soaked inner node the slope is the mean of both chords': the chamber strays to both sides, and the
    kink that the table has there, which the unit's curve has not, would pull the node.
    """
    weights = read(temperature_degc, nodes)
    nearest = np.argmin(np.abs(temperature_degc[:, None] - nodes), axis=1)
    for k in range(1, len(nodes) - 1):
        rows = np.flatnonzero(nearest == k)
        off = temperature_degc[rows] - nodes[k]
        if len(rows) and np.abs(off).max() <= APART_K:
            below, above = off / (2.0 * (nodes[k] - nodes[k - 1])), off / (2.0 * (nodes[k + 1] - nodes[k]))
            weights[rows] = 0.0
            weights[rows, k - 1], weights[rows, k], weights[rows, k + 1] = -below, 1.0 + below - above, above
    return weights
