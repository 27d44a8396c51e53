"""A table that turns by another rate than it says: by a share of every rate, of some, or one way.

    y = (1 + κ) M ω (1 + s),   s one coefficient for all gyros

Where it acts is the place of the hypothesis.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.references.bench_directions import loaded, through_the_unit
from planner.diagnose.references.rate_of_each_level import sense
from planner.diagnose.shapes.generic import REST_RATE
from planner.effects._bench_frame import turning
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable

MOST_THRESHOLDS = 8  # between the rates that were set; neighbours explain nearly the same
ONE_WAY = -1.0  # a table may be wrong in one sense of turning instead of above a rate
OTHER_WAY = -4.0  # or in the other, which beside a scale factor only turns elsewhere tell from it
GROWING, STEADY = -2.0, -3.0  # or by a share that grows with the rate, or by as much at every rate
ANYWHERE = 1e3  # rad/s, beside a rate above which it is wrong on the centrifuge as well: one drive turns both


def off_by_a_share(c: Channel, table: DwellTable, place: float) -> Array:
    """A share of the rate: of every one or above one, one way, or growing to that share at the fastest.

    A servo that is off by as much at every rate is so by that share of the slowest.
    """
    conditions = c.model.conditions
    size = np.linalg.norm(conditions.rate, axis=1)
    here, least = (True, place - ANYWHERE) if place > ANYWHERE else (~loaded(conditions), place)
    wrong = (size > max(least, REST_RATE)) & here
    if not wrong.any():
        return np.zeros((len(size), 1))
    share = np.where(wrong, 1.0, 0.0)
    if place in (ONE_WAY, OTHER_WAY):
        share *= sense(conditions) * (1.0 if place == ONE_WAY else -1.0) > 0.0
    elif place == GROWING:
        share *= size / size[wrong].max()
    elif place == STEADY:
        share *= size[wrong].min() / np.maximum(size, REST_RATE)
    return through_the_unit(c, [conditions.rate * share[:, None]])


def of_every_gyro(place: float) -> str:
    """The error that the gyros would have in common, were it not the table: of other places a curve."""
    if place == 0.0:
        return "scale_factor"
    return "scale_factor_asymmetry" if place in (ONE_WAY, OTHER_WAY) else "scale_factor_nonlinearity"


def set_ways(table: DwellTable) -> Sequence[float]:
    """Above which rates a table may be wrong, in which sense of turning, and how, as far as it turned so."""
    if table.ref_rate is None:
        return ()
    conditions = table.conditions()
    arm = loaded(conditions)
    turned = set(sense(conditions)[~arm].tolist())
    above = thresholds(conditions, ~arm)
    both = thresholds(conditions, turning(conditions)) if arm.any() else ()
    curved = (GROWING, STEADY) if len(above) > 1 else ()  # one rate alone shows neither
    ways = (ONE_WAY, *((OTHER_WAY,) if arm.any() else ())) if {-1.0, 1.0} <= turned else ()
    anywhere = (ANYWHERE + rate for rate in both[1:])  # that of every rate is the gyros' own scale factor
    return (*above, *ways, *curved, *anywhere)


def thresholds(conditions: Conditions, here: NDArray[np.bool_]) -> Sequence[float]:
    """Rates above which a drive may be wrong: none, and between the levels of some records (n,), rad/s."""
    size = np.linalg.norm(conditions.rate[here], axis=1)
    levels = np.unique(np.round(size[size > REST_RATE], 3))
    apart = levels[np.append(True, np.diff(levels) > 0.05 * levels[1:])] if len(levels) else levels
    between = (apart[1:] + apart[:-1]) / 2.0
    kept = np.unique(np.linspace(0, len(between) - 1, min(len(between), MOST_THRESHOLDS)).round().astype(int))
    return (0.0, *between[kept].tolist()) if len(between) else (0.0,)
