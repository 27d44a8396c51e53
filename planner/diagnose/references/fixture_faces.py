"""The faces of a fixture: each leans by its own two angles, in every power-on in which the unit rests on it.

    δu = θ_face × u   at rest,  θ_face across up

A cube that is not square, an index head whose stops are off. On a face the channel that is up sees nothing of
it and the two others an angle each: no two channels share one, and what all three of them see between faces
is still the fixture's, while a product of forces is one channel's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.references.bench_directions import loaded, through_the_unit
from planner.effects._bench_frame import turning, upwards
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable

ALONG = 0.99  # cosine of two directions that are one face: 8 deg
LEAST = 5  # faces: of four, leans and biases explain what these angles do
MOST = 14  # six faces and eight corners; a unit that rests anywhere has no faces
SEVERAL = 2  # power-ons in which a face is, from which it is none of a power-on


def leaning_faces(c: Channel, table: DwellTable, place: float) -> Array:
    """(n, 2 faces) what an angle about each of two axes across up adds on every face."""
    conditions = c.model.conditions
    u = conditions.specific_force
    found = []
    for face, rows in _faces(conditions, table.run):
        here = u * rows[:, None]
        first = np.cross(face, np.eye(3)[int(np.argmin(np.abs(face)))])
        first /= np.linalg.norm(first)
        found += [np.cross(e, here) for e in (first, np.cross(face, first))]
    return through_the_unit(c, found)


def resting_on_faces(table: DwellTable) -> Sequence[float]:
    """One place, where a unit rests on some faces and comes back to them."""
    return (0.0,) if LEAST <= len(_faces(table.conditions(), table.run)) <= MOST else ()


def _faces(conditions: Conditions, run: NDArray[np.int64]) -> list[tuple[Array, NDArray[np.bool_]]]:
    """Up in body axes and (n,) rows of every face that several power-ons have."""
    up = upwards(conditions)
    still = ~turning(conditions) & ~loaded(conditions)
    left = still.copy()
    found: list[tuple[Array, NDArray[np.bool_]]] = []
    while left.any() and len(found) <= 2 * MOST:
        rows = still & (up @ up[int(np.argmax(left))] > ALONG)
        left &= ~rows
        if len(np.unique(run[rows])) >= SEVERAL:
            face = up[rows].mean(axis=0)
            found.append((face / np.linalg.norm(face), rows))
    return found
