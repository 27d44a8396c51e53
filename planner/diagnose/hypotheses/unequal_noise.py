"""Noise that is not the same at all temperatures: how much larger it is there, where the rows are sure of it.

Of what neither model nor candidates explain, about the mean of each power-on, the mean modulus of each
temperature is compared (Levene's test about the mean; Brown, Forsythe, JASA 69, 1974): moduli, because heavy
tails would make squares look unequal. A unit twice as noisy in the heat would otherwise have "something that
varies with temperature" there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.whitened import Whitened
from planner.nouns.array import Array
from planner.temperature_table import temperature_nodes

SURE = 1e-4  # p of the test, below which rows are weighed
LEAST_ROWS = 15  # of a temperature
MOST = 9.0  # times the variance that one temperature may have of another


def weights_over_temperature(
    w: Whitened, temperature_degc: Array, starts: NDArray[np.int64], judged: NDArray[np.bool_]
) -> Array | None:
    """(n,) weight of every row, the variance of all over that at its temperature; None where it is the same.

    judged: (n,) rows that are not left out
    """
    from scipy.stats import f as fisher

    sizes = np.diff(np.append(starts, len(temperature_degc)))
    about = np.abs(w.remainder - np.repeat(np.add.reduceat(w.remainder, starts) / sizes, sizes))
    about /= np.repeat(np.sqrt(1.0 - 1.0 / np.maximum(sizes, 2)), sizes)
    nodes = temperature_nodes(temperature_degc)
    group = np.argmin(np.abs(temperature_degc[:, None] - nodes[None, :]), axis=1)
    count = np.bincount(group[judged], minlength=len(nodes))
    told = count >= LEAST_ROWS
    rows = judged & told[group]
    k, n = int(told.sum()), int(rows.sum())
    if k < 2:
        return None
    mean = np.bincount(group[rows], about[rows], len(nodes)) / np.maximum(count, 1)
    every = float(about[rows].mean())
    between = float(np.sum(count[told] * (mean[told] - every) ** 2)) / (k - 1)
    within = float(np.sum((about[rows] - mean[group[rows]]) ** 2)) / max(n - k, 1)
    if within <= 0.0 or fisher.sf(between / within, k - 1, n - k) > SURE:
        return None
    ratio = (every / np.where(told & (mean > 0.0), mean, every)) ** 2
    return np.asarray(np.clip(ratio, 1.0 / MOST, MOST)[group])
