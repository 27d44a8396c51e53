"""What every visit of a campaign is worth: the hours it takes and the metres that it buys.

Each visit is left out, made once less and once more, all else as it is, and the promise asked again.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.information.choose import Found
from planner.information.neighbours import altered
from planner.nouns.array import Array
from planner.nouns.plan import Worth


def worth_of(found: Found) -> tuple[Worth, ...]:
    """Every visit of the campaign, in the order of the plan's tests.

    Figures are the largest over the families, of every requirement, SI; infinite where something that
    flies is undetermined without it.
    """
    n = found.counts
    places = (int(k) for offer in found.offers.tests for k in offer.places)
    kinds = [k for k in places if n[k] > 0]
    changed = np.array([altered(n, (k, to)) for k in kinds for to in (0, max(n[k] - 1, 0), n[k] + 1)])
    figures = found.judge.figures(changed) / found.spread_factors
    saved = float(found.offers.cost(n[None])[0]) - found.offers.cost(changed)
    return tuple(_worths(found, kinds, figures.reshape(len(kinds), 3, -1), saved.reshape(len(kinds), 3)))


def _worths(found: Found, kinds: list[int], figures: Array, saved: Array) -> Iterator[Worth]:
    for k, of, seconds in zip(kinds, figures, saved, strict=True):
        kind = found.offers.kinds[k]
        yield Worth(
            kind.test,
            kind.temperature_degc,
            int(found.counts[k]),
            float(seconds[0]),
            float(seconds[1]),
            *(tuple(map(float, row)) for row in of),
        )
