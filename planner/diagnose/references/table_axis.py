"""A unit off the table's axis, in campaigns with an arm as well.

    δu = ω × (ω × r)   in turns of the table

`lever_arm` of the library acts wherever something turns. The radius of an arm is surveyed to the
accelerometers: where a campaign has both, an r on its loads takes up what the table has, a share r / R of
them, and the products of forces that are left looked like a cross-coupling.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.references.bench_directions import loaded, through_the_unit
from planner.effects._bench_frame import turning
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable


def off_the_axis(c: Channel, table: DwellTable, place: float) -> Array:
    """(n, 3) per metre of r along each body axis."""
    conditions = c.model.conditions
    w = conditions.rate * _on_the_table(conditions)[:, np.newaxis]
    return through_the_unit(c, [np.cross(w, np.cross(w, e)) for e in np.eye(3)])


def beside_an_arm(table: DwellTable) -> Sequence[float]:
    """One place, where the unit turns on a table and on an arm: of one of them alone it is `lever_arm`."""
    conditions = table.conditions()
    on_the_table = _on_the_table(conditions)
    return (0.0,) if on_the_table.any() and (turning(conditions) & ~on_the_table).any() else ()


def _on_the_table(conditions: Conditions) -> NDArray[np.bool_]:
    """(n,) whether the unit turns under gravity alone."""
    return np.asarray(turning(conditions) & ~loaded(conditions))
