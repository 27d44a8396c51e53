"""The Earth's rate, left out of the reference of turns alone: a table's rate is entered as it was set.

    y += Ω sin φ · a (a · up),   a the axis of the turn;   where it lies, a (a · n) of whichever way n points

Rests have it, and it is no `earth_rate` of all records. What it leaves is the same on both ways of turning: a
curve over the rate of three gyros with a step at zero.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.diagnose.channels.channel import Channel
from planner.diagnose.references.bench_directions import HORIZONTAL, loaded
from planner.effects._bench_frame import turning, upwards
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.physics.attitude import unit
from planner.physics.earth import EARTH_RATE_RADPS

TERMS = ("up", "", "", "")  # behind it, of a level axis that is each of the body's
ROUGHLY = 0.1  # of the Earth's rate, to which a reference at rest has it
UPRIGHT = 0.7  # cosine of a turn's axis with up, from which it is no level one
ON_THE_TABLE, EVERY_TURN = 0.0, 1.0


def left_out_of_turns(c: Channel, table: DwellTable, place: float) -> Array:
    """(n, 4) per rad/s of the Earth's rate along up, and along a level axis."""
    conditions = c.model.conditions
    axis, up = unit(conditions.rate), upwards(conditions)
    turns = turning(conditions) & ((place == EVERY_TURN) | ~loaded(conditions))
    about_up = np.sum(axis * up, axis=1)
    upright = (np.abs(about_up) > UPRIGHT) & turns
    vertical = axis * (about_up * upright)[:, None]
    level = (turns & ~upright).astype(float)
    lying = [np.abs(axis[:, k]) * level * (c.axis == k) for k in range(3)]
    return np.column_stack([vertical[:, c.axis] * c.lean, *(x * c.lean for x in lying)])


def known_at_rest(table: DwellTable) -> Sequence[float]:
    """Turns of the table, and those on the arm too, where rests have the Earth's rate in their reference."""
    if table.ref_rate is None:
        return ()
    conditions = table.conditions()
    turns, arm = turning(conditions), loaded(conditions)
    if not (np.linalg.norm(table.ref_rate[~turns], axis=1) > HORIZONTAL).any():
        return ()
    on_the_table, on_the_arm = bool((turns & ~arm).any()), bool(arm.any())
    return (*((ON_THE_TABLE,) if on_the_table else ()), *((EVERY_TURN,) if on_the_arm else ()))


def as_at_rest(table: DwellTable) -> tuple[Array, Array]:
    """Bounds of the four coefficients: along up what the rests have of it, along a level axis up to the rest.

    Ω sin φ = median of ref_rate · up at rest,   |level| ≤ √(Ω² − (Ω sin φ)²)
    """
    conditions = table.conditions()
    rests = ~turning(conditions)
    along = np.sum(conditions.rate * upwards(conditions), axis=1)[rests]
    up = float(np.median(along))
    level = np.sqrt(max(EARTH_RATE_RADPS**2 - up**2, 0.0))
    slack = ROUGHLY * EARTH_RATE_RADPS
    most = np.array([up, level, level, level]) + slack
    return np.array([up, -level, -level, -level]) - slack, most
