"""What a chamber that strays makes of curves that nobody knows: noise of every record.

Around the soaked temperature T a record is made at T + δ, δ ~ N(0, σ_T²), and the curve f differs there by
f'(T) δ from the value that the table has at T. The table's own slope from node to node, which is corrected
with, is left out: where the stray counts, curves are rough, and it is the smaller part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from planner.nouns.array import Array
from planner.verify.chance import Chance
from planner.verify.records import Records
from planner.verify.second_moments import Error, Moment

Strays = Mapping[Error, Array]
"""Error -> (n,) in every record, one sigma, SI."""
STILL: Strays = MappingProxyType({})
AROUND_K = 0.05  # between which slopes are taken: the segments of a curve's grid are longer


def strays_of(
    records: Records, chance: Chance, prior: Mapping[Error, Sequence[Moment]]
) -> dict[Error, Array]:
    """What a fit knows of it: the root mean square over the families; prior: error -> moments of each."""
    degc, at = np.unique(np.round(records.conditions.temperature_degc, 9), return_inverse=True)
    return {
        error: chance.temperature_jitter * np.sqrt(np.mean([squares(m, degc) for m in each], axis=0))[at]
        for error, each in prior.items()
    }


def squares(moment: Moment, degc: Array) -> Array:
    """(N,) mean squares of a curve's slopes at temperatures (N,), (SI/K)²."""
    return np.maximum(np.diag(moment.of_slopes(degc, AROUND_K)), 0.0)
