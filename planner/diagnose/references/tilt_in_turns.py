"""What a base that leans does to records in which the unit turns: nothing of what whole turns average out.

A lean d, horizontal and fixed on the base, adds g d to the specific force on the base. A turn by θ = |ω| T
about the axis a, which stands still there, has in body axes the mean

    g (1 − s) (a·d) a + g s d_m,   s = sin(θ/2) / (θ/2),   d_m  the lean in body axes at mid-turn.

Level axis: d_m = (a·d) a + β a × u with u up at mid-turn, and the mean force is g s u,

    g (α a + β a × f̄ / g).

Upright axis: d_m is d of the beginning, turned back by half the turn,  g s R_a(−ω T / 2) d₀.

Which way the axis points on the base, and where an upright turn begins, no record says: α, β and the two of
d₀ are coefficients of each body axis, and all turns about one that points up begin at one place.

What is left of s is asked for by itself, at the place PARTS: after ten turns it is a hundredth, and eight
coefficients of which records tell hardly anything cost a base that leans its name.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.references.bench_directions import UNLOADED, loaded
from planner.effects._bench_frame import turning
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.physics.attitude import cross, unit
from planner.units import STANDARD_GRAVITY_MPS2

AXES = 3
COLUMNS = 4 * AXES  # along and across a level axis, two of an upright one
UPRIGHT = 0.98  # of g along the axis of a turn
LEAST = 0.02  # of a turn's axis along a body axis, or of s: of less nothing is seen
PARTS = 1.0  # the place that has what turns leave of s; of others those of one bench, where it is LARGE
LARGE = 0.1
AT_REST = ("north", "east", *COLUMNS * ("",))  # the coefficients by which a lean is told
IN_TURNS = tuple(  # … where nothing rests: a pair of those of one axis
    tuple(("one", "other")[k - pair] if k in (pair, pair + 1) else "" for k in range(2 + COLUMNS))
    for pair in range(2, 2 + COLUMNS, 2)
)


def parts_of_turns(conditions: Conditions, duration: Array, least: float = LEAST) -> bool:
    """Whether any record's turn leaves more than a share of a lean that goes round."""
    return bool(np.any(np.abs(_left(conditions, duration)) > least))


def _half(conditions: Conditions, duration: Array) -> Array:
    """(n,) rad, θ / 2."""
    return np.asarray(np.linalg.norm(conditions.rate, axis=1) * duration / 2.0)


def _turns(conditions: Conditions) -> NDArray[np.bool_]:
    """(n,) whether a record turns under gravity alone."""
    return turning(conditions) & ~loaded(conditions)


def _left(conditions: Conditions, duration: Array) -> Array:
    """(n,) s of records that turn under gravity alone, 0 of others."""
    return np.where(_turns(conditions), np.sinc(_half(conditions, duration) / np.pi), 0.0)


def tilted_turns(conditions: Conditions, duration: Array, parts: bool) -> list[Array]:
    """COLUMNS directions (n, 3), in g, that a lean of 1 rad adds to the mean force.

    duration: (n,) s; parts: whether to ask for what is left of s, else those directions are zero
    """
    f = conditions.specific_force / STANDARD_GRAVITY_MPS2
    axis = np.where(_turns(conditions)[:, None], unit(conditions.rate), 0.0)
    axis = np.where(np.abs(axis) < LEAST, 0.0, axis)
    along = np.sum(axis * f, axis=1)
    level, upright = np.abs(along) < UNLOADED, np.abs(along) > UPRIGHT
    half, left = _half(conditions, duration), _left(conditions, duration) * parts
    found: list[Array] = []
    for k in range(AXES):
        one = np.broadcast_to(np.eye(AXES)[k], f.shape)
        size = (level * np.abs(axis[:, k]))[:, None]
        found += [size * one, size * cross(one, f) * parts]
    for k in range(AXES):
        back = -np.sign(axis[:, k]) * half
        size = upright * (f[:, k] > 0.0) * np.abs(axis[:, k]) * left
        first, second = np.eye(AXES)[(k + 1) % AXES], np.eye(AXES)[(k + 2) % AXES]
        cos, sin = (size * np.cos(back))[:, None], (size * np.sin(back))[:, None]
        found += [cos * first + sin * second, cos * second - sin * first]
    return found
