"""What a sweep of temperature shows between the nodes of a table: a bump, a step, a wave.

Hat functions over one or two nodes more in every gap. A smooth curve leaves something there as well, h²/8 of
its second derivative: it is no missing effect, so the columns are clear of the table and of a polynomial.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.nouns.array import Array
from planner.temperature_table import hats

PARTS = (2, 3)  # of a gap of 10 K: bends of a kelvin are the thermometer's
LEAST_ROWS = 4  # nearer to a node than to its neighbours, that carry it
LEAST = 3  # such nodes: a sweep, not a record that strayed
DEGREE = 5  # of what counts as smooth over a unit's range: three bends of its slope
ROUNDING = 1e-6


def between_nodes(temperature_degc: Array, nodes: Array) -> Iterator[Array]:
    """(n, k) columns of finer tables between the nodes (N,); none where no sweep fills them."""
    if len(nodes) < 2:
        return
    x = (temperature_degc - temperature_degc.mean()) / max(float(np.ptp(temperature_degc)), 1e-9)
    powers = (x**k for k in range(1, DEGREE + 1))
    smooth = orthonormal(np.column_stack([hats(temperature_degc, nodes, 0.0), *powers]))
    for parts in PARTS:
        at = np.arange((len(nodes) - 1) * parts + 1) / parts
        fine = np.interp(at, np.arange(len(nodes)), nodes)
        weights = hats(temperature_degc, fine, 0.0)
        inner = at % 1.0 > 0.0
        told = inner & (np.sum(weights > 0.5, axis=0) >= LEAST_ROWS)
        if told.sum() >= LEAST:
            yield orthonormal(clear(smooth, weights[:, told]), ROUNDING)
