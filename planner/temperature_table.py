"""Temperatures of the data → nodes of a piecewise-linear table, and the table's hat functions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

REACH_K = 5.0  # kelvins beyond its end nodes over which a table goes on
GAP_K = 3.0  # chamber points lie further apart; a soaked chamber strays by 2 K at most (K 2.6)
SWEEP_K = 10.0  # spacing of nodes where the temperature was swept instead of soaked
LEAST_ROWS = 2
ALONE_K = 1.0  # between one row and the next, as records on a ramp have, and those of a room have not


def steps_within(low: float, high: float, step: float) -> Array:
    """(n,) the multiples of a step from low to high, and both ends, ascending."""
    return np.unique([low, *np.arange(np.ceil(low / step), high / step) * step, high])


def temperature_nodes(temperature_degc: Array) -> Array:
    """(N,) nodes: the middle of every cluster of temperatures, evenly spaced ones across a sweep.

    temperature_degc: (n,) of the rows that tell something. Empty in, empty out.
    """
    t = np.sort(temperature_degc)
    if len(t) == 0:
        return t
    clusters = np.split(t, np.flatnonzero(np.diff(t) > GAP_K) + 1)
    nodes = [
        node for cluster in clusters if len(cluster) >= LEAST_ROWS or len(t) < 8 for node in _of(cluster)
    ]
    return np.array(nodes if nodes else [_median(t)])


def _of(cluster: Array) -> Array:
    if cluster[-1] - cluster[0] <= 2.0 * GAP_K:
        return np.array([_median(cluster)])
    low, high = np.percentile(cluster, [0.5, 99.5])
    if high - low <= 2.0 * GAP_K:
        return np.array([_median(cluster)])
    return np.linspace(low, high, max(2, int(np.ceil((high - low) / SWEEP_K)) + 1))


def _median(rising: Array) -> float:
    """The middle of (n,) values that rise; np.median and percentiles would import numpy.ma, 15 ms."""
    return float(0.5 * (rising[(len(rising) - 1) // 2] + rising[len(rising) // 2]))


def hats(temperature_degc: Array, nodes: Array, reach: float) -> Array:
    """(n, N) weights of the nodes at each temperature: linear between nodes.

    The end segments go on for `reach` kelvins beyond the end nodes; from there the table is constant.
    """
    if len(nodes) == 1:
        return np.ones((len(temperature_degc), 1))
    t = np.clip(temperature_degc, nodes[0] - reach, nodes[-1] + reach)
    left = np.clip(np.searchsorted(nodes, t, side="right") - 1, 0, len(nodes) - 2)
    share = (t - nodes[left]) / (nodes[left + 1] - nodes[left])
    weights = np.zeros((len(t), len(nodes)))
    rows = np.arange(len(t))
    weights[rows, left] = 1.0 - share
    weights[rows, left + 1] = share
    return weights


def nodes_with_rows(nodes: Array, temperature_degc: Array) -> Array:
    """The nodes that are the nearest one of some row; all when there is no row."""
    if len(temperature_degc) == 0:
        return nodes
    nearest = np.argmin(np.abs(temperature_degc[:, None] - nodes[None, :]), axis=1)
    return np.asarray(nodes[np.bincount(nearest, minlength=len(nodes)) > 0])  # np.unique imports numpy.ma too


def from_soaked(temperature_degc: Array, nodes: Array) -> tuple[NDArray[np.intp], Array]:
    """(n,) the nearest node of every row, and (n,) kelvins from it where its rows are all strays about it.

    0 elsewhere: the temperature was swept.
    """
    nearest = np.argmin(np.abs(temperature_degc[:, None] - nodes[None, :]), axis=1)
    apart = temperature_degc - nodes[nearest]
    return nearest, np.where(strays_only(nodes, nearest, apart)[nearest], apart, 0.0)


def strays_only(nodes: Array, nearest: NDArray[np.int64], apart: Array) -> NDArray[np.bool_]:
    """(N,) nodes whose rows (n,) are all strays about one soaked point: what a ramp passes has more.

    A cluster 2 GAP_K wide is one node (`temperature_nodes`), and its middle may lie at one of its ends; it
    is one point where the next node is four times as far, and no row of a ramp stands apart from the others.
    """
    farthest = np.zeros(len(nodes))
    np.maximum.at(farthest, nearest, np.abs(apart))
    between = np.abs(nodes[:, None] - nodes) + np.diag(np.full(len(nodes), np.inf))
    within = np.minimum(between.min(axis=1) / 4.0, 2.0 * GAP_K)
    soaked = farthest <= GAP_K
    for k in np.flatnonzero(~soaked & (farthest <= within)):
        soaked[k] = np.diff(np.sort(apart[nearest == k])).max() <= ALONE_K
    return np.asarray(soaked)


def fitting_hats(temperature_degc: Array, nodes: Array, reach: float) -> Array:
    """(n, N) weights for the fit: the table's, with the mean of both chords' slopes about a soaked node.

    A soaked chamber strays by 0.05 K to both sides. The table has a kink at the node and the unit's curve has
    none: chord by chord every stray would err to the same side, and the node with them.
    """
    weights = hats(temperature_degc, nodes, reach)
    if len(nodes) < 3:
        return weights
    nearest, apart = from_soaked(temperature_degc, nodes)
    rows = np.flatnonzero((apart != 0.0) & (nearest > 0) & (nearest < len(nodes) - 1))
    k, apart, half = nearest[rows], apart[rows], 0.5 / np.diff(nodes)
    weights[rows] = 0.0
    weights[rows, k - 1] = -half[k - 1] * apart
    weights[rows, k] = 1.0 + (half[k - 1] - half[k]) * apart
    weights[rows, k + 1] = half[k] * apart
    return weights
