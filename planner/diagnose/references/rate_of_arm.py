"""A centrifuge whose rate is read off by another share at every level: a coarse counter, a servo.

    δω_l = γ_l ω_l,   δa_l = 2 γ_l a_l   at each level l of the arm but the last,  common to the channels

What is rounded to a tenth of deg/s is off by 2e-3 of the least loads and by nothing of some others: it was a
curve over the load of three accelerometers, and one over the rate of three gyros.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.diagnose.channels.channel import Channel
from planner.diagnose.references.bench_directions import loaded, through_the_unit
from planner.diagnose.references.rate_of_each_level import but_the_last, levels_of, one_place
from planner.effects._bench_frame import load
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable

LEAST = 3  # levels: of two a longer arm and one that gives way say all
ONE_LEVEL = 0.005  # of a rate, by which records of one level differ: a hundredth of the load


def off_at_each_load(c: Channel, table: DwellTable, place: float) -> Array:
    """(n, levels − 1) a share of the arm's rate at each level, beside that at the last one.

    What all have in common is a longer arm, and scale factors nearly.
    """
    conditions = c.model.conditions
    level = _levels(conditions)
    felt = conditions.rate if c.sensor == "gyro" else 2.0 * load(conditions)
    return but_the_last(through_the_unit(c, [felt])[:, 0], level)


def set_loads(table: DwellTable) -> Sequence[float]:
    """One place, where an arm is set to some levels again and again."""
    if table.ref_rate is None:
        return ()
    return one_place(_levels(table.conditions()), LEAST)


def _levels(conditions: Conditions) -> Array:
    """(n,) number of each row's level on the arm; −1 of all other rows."""
    return levels_of(np.linalg.norm(conditions.rate, axis=1), loaded(conditions), ONE_LEVEL)
