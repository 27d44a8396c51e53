"""Another unit's accelerometers in a few power-ons in turn, behind which the first one is back.

Where the few have a temperature of their own the declared curve takes their levels up: what ramps through
that temperature say was then a table over the rate of temperature, beside unknowns of every channel. Leans
are told within power-ons (`leans_of_sets`): the gain of those of the few is beyond chance on every channel,
and hardly any of it is left over: a curve that a parabola does not follow leaves as much at other
temperatures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.records.changed_power_ons import LONGEST, SIDE
from planner.diagnose.records.leans_of_sets import leans_of_sets, of_both
from planner.nouns.array import Array

LEAST_OTHERS = 6  # power-ons of the unit before and behind
LEFT_OVER = 0.1  # of the gain, that leans of all others may differ by


@dataclass(frozen=True)
class Few:
    """log_p: of three channels together, over all places; weakest: of one; there: (runs,) which power-ons"""

    log_p: float
    weakest: float
    there: NDArray[np.bool_]


def few_in_turn(y: Array, u: Array, run: NDArray[np.int64], temperature: Array) -> Few | None:
    """The few power-ons in turn whose leans differ most; None where none differ by most of what there is.

    y, u: (n, 3) readings and references of accelerometers at rest, run by run; run: (n,) 0 … runs − 1
    Asked again by the attitudes that others have too: what a face of its own adds is no lean.
    """
    runs = int(run.max(initial=-1)) + 1
    sets = _sets(runs)
    if runs < LEAST_OTHERS + SIDE or len(sets) == 0:
        return None
    first = leans_of_sets(y, u, run, temperature, sets)
    place = int(np.argmin(first[0].sum(axis=0)))
    there = sets[place]
    kept = of_both(u, there[run])
    number, again = np.unique(run[kept], return_inverse=True)
    mine = there[number]
    if np.count_nonzero(mine) < SIDE or np.count_nonzero(~mine) < LEAST_OTHERS:
        return None
    log, left = leans_of_sets(y[kept], u[kept], again, temperature[kept], mine[None, :])
    if left.max() > LEFT_OVER:
        return None
    places = np.log(len(sets))
    return Few(float(log.sum() + places), float(log.max() + places), there)


def _sets(runs: int) -> NDArray[np.bool_]:
    """(w, runs) a few power-ons in turn, neither the first nor the last."""
    spans = [
        (a, b)
        for a in range(1, runs - SIDE)
        for b in range(a + SIDE, min(a + LONGEST, runs - 1) + 1)
        if runs - (b - a) >= LEAST_OTHERS
    ]
    order = np.arange(runs)
    return np.array([(order >= a) & (order < b) for a, b in spans], dtype=bool).reshape(-1, runs)
