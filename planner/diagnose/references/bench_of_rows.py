"""Which rows were taken on one bench: what is wrong with that bench is wrong with these and no others.

By the column `bench` where it tells several apart; else power-ons with turns, and those without.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.references.bench_directions import loaded
from planner.effects._bench_frame import turning
from planner.nouns.dwell_table import DwellTable

MOST = 6  # benches that are told apart: each is a hypothesis of its own
ON_BENCH = 10.0  # places of a hypothesis from here on are the first bench among several, the second …


def rows_by_bench(table: DwellTable) -> list[NDArray[np.bool_]]:
    """(n,) rows under gravity alone of every bench that has any; none where there is one alone."""
    conditions = table.conditions()
    here = ~loaded(conditions)
    if table.bench is not None and len(np.unique(table.bench[here])) > 1:
        apart = [here & (table.bench == name) for name in np.unique(table.bench[here])]
    else:
        turned = np.isin(table.run, np.unique(table.run[here & turning(conditions)]))
        apart = [here & turned, here & ~turned]
    apart = [rows for rows in apart if rows.any()]
    return apart if 1 < len(apart) <= MOST else []


def named_benches(table: DwellTable) -> Sequence[float]:
    """Places of the benches that the column `bench` tells apart; none without it.

    Turns and rests, which `rows_by_bench` tells apart else, may be on one bench, of one gravity.
    """
    if table.bench is None or len(np.unique(table.bench[~loaded(table.conditions())])) < 2:
        return ()
    return tuple(ON_BENCH + k for k in range(len(rows_by_bench(table))))


def on_bench(table: DwellTable, place: float) -> NDArray[np.bool_]:
    """(n,) rows on the bench of a place; all rows where the place is none of a bench."""
    if place < ON_BENCH:
        return np.ones(len(table), dtype=bool)
    return rows_by_bench(table)[int(place - ON_BENCH)]
