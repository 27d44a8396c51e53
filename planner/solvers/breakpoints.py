"""Where to put the nodes of a piecewise-linear table so that its worst deviation from a curve is least."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Placement:
    """Indices of the chosen nodes, and the largest absolute deviation that is left."""

    indices: tuple[int, ...]
    residual: float


def table_residual(x: Array, y: Array, nodes_x: Array, nodes_y: Array) -> float:
    """max |y_i − table(x_i)|, the table linear between its nodes and constant outside them."""
    return float(np.max(np.abs(y - np.interp(x, nodes_x, nodes_y))))


def _segment_costs(x: Array, y: Array) -> Array:
    """cost[i, j] = largest deviation of the points between i and j from the chord; inf for j <= i."""
    m = len(x)
    cost = np.full((m, m), np.inf)
    for i in range(m - 1):
        # (points, ends): chord from i to every later j, evaluated at every later point
        dx = x[i + 1 :] - x[i]
        dy = y[i + 1 :] - y[i]
        deviation = np.abs(dy[:, None] - dx[:, None] * (dy / dx)[None, :])
        inside = np.arange(m - i - 1)[:, None] < np.arange(m - i - 1)[None, :]
        cost[i, i + 1 :] = np.where(inside, deviation, 0.0).max(axis=0, initial=0.0)
    return cost


def optimal_breakpoints(x: Array, y: Array, most: int) -> tuple[Placement, ...]:
    """The placements of 1, 2, …, `most` nodes that minimise the worst deviation, exactly.

    x: (m,) strictly increasing abscissae; y: (m,) the curve. Nodes are taken among the points; the table is
    linear between nodes and constant outside. Dynamic programming over the last node:

        E_1(j) = max_{i <= j} |y_i − y_j|,   E_n(j) = min_{i < j} max(E_{n−1}(i), c(i, j)),
        answer_n = min_j max(E_n(j), max_{i >= j} |y_i − y_j|)

    with c(i, j) the largest deviation from the chord between i and j. O(most · m²) after O(m³) chords.
    Exactly n nodes are placed, so a node more can leave more: it may have to be an outlier of the curve.
    Raises ValueError when x does not increase or there are fewer than two points.
    """
    if len(x) < 2 or np.any(np.diff(x) <= 0):
        raise ValueError("a curve needs at least two points with increasing abscissae")
    m = len(x)
    away = np.abs(y[:, None] - y[None, :])
    head = np.where(np.tri(m, dtype=bool).T, away, 0.0).max(axis=0)  # points before node j
    tail = np.where(np.tri(m, dtype=bool), away, 0.0).max(axis=0)  # points after node j
    cost = _segment_costs(x, y)
    best = head
    came_from: list[NDArray[np.int64]] = []
    placements = []
    for n in range(1, min(most, m) + 1):
        if n > 1:
            through = np.maximum(best[:, None], cost)
            came_from.append(through.argmin(axis=0))
            best = through.min(axis=0)
        total = np.maximum(best, tail)
        last = int(total.argmin())
        nodes = [last]
        for previous in reversed(came_from):
            nodes.append(int(previous[nodes[-1]]))
        placements.append(Placement(tuple(reversed(nodes)), float(total[last])))
    return tuple(placements)
