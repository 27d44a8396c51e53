"""Whether gyros and accelerometers agree on axes and signs, by the turns between rests.

Between two rests gravity turns in the body: df/dt = −ω × f. Of the 48 ways to name and sign the gyros' axes
only the right one carries the specific force of one rest to that of the next. The signs of all three
accelerometers together leave no trace here; they need a reference.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice, permutations, product

import numpy as np

from planner.nouns.array import Array
from planner.recordings.column_map import AXES
from planner.recordings.rests import Segment
from planner.recordings.turns import Turn, apart, carried, neighbours
from planner.recordings.windows import Windows

LEAST_TURN = np.radians(30.0)
AGREES = np.radians(10.0)
APART = np.radians(30.0)
LEAST_TURNS, MOST_TURNS = 3, 40


def axis_fault(windows: Windows, rests: Sequence[Segment]) -> str:
    """A sentence on axes that are swapped or signs that are turned, or nothing.

    Said only when it is sure: at least three turns, the axes as they are miss by over 30° on average, another
    choice is right within 10° and every other one is twice as far off.
    """
    turns = list(islice(_turns(windows, rests), MOST_TURNS))
    if len(turns) < LEAST_TURNS:
        return ""
    signs = list(product((1.0, -1.0), repeat=3))
    choices = np.array([np.diag(s)[list(p)] for p in permutations(range(3)) for s in signs])
    missed = np.mean([_misses(turn, choices) for turn in turns], axis=0)
    here = 0  # the first permutation is none, the first signs are all +
    first, second = np.argsort(missed)[:2]
    if missed[here] < APART or missed[first] > AGREES or missed[second] < 2 * missed[first] + AGREES:
        return ""
    return (
        f"the gyros' axes do not fit the accelerometers': over {len(turns)} turns gravity ends "
        f"{_degrees(missed[here])} beside where the gyros say; "
        f"with {_named(choices[first])} it is {_degrees(missed[first])}"
    )


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle):.0f}°"


def _named(choice: Array) -> str:
    """`gyro x from -y, …`: which column, as the map has it now, belongs to each axis."""
    found = []
    for name, row in zip(AXES, choice, strict=True):
        column = int(np.argmax(np.abs(row)))
        found.append(f"{name} from {'-' if row[column] < 0 else ''}{AXES[column]}")
    return "gyro " + ", ".join(found)


def _turns(windows: Windows, rests: Sequence[Segment]) -> Iterator[Turn]:
    """Those by at least 30° between neighbouring rests."""
    for a, b, before, after in neighbours(windows, rests):
        f, g = (x[3:] / max(float(np.linalg.norm(x[3:])), 1e-12) for x in (before, after))
        if np.arccos(np.clip(f @ g, -1, 1)) < LEAST_TURN:
            continue
        part = slice(a.last - 1, b.first + 1)  # the turn reaches into the rests' last and first windows
        spacing = np.diff(windows.start[a.last - 1 : b.first + 2])
        yield f, g, (windows.mean[part, :3][: len(spacing)] - before[:3]) * spacing[:, None]


def _misses(turn: Turn, choices: Array) -> Array:
    """Angles (c,) between gravity as the accelerometers end and as gyros of (c, 3, 3) choices carry it."""
    before, after, small = turn
    direction = np.tile(before, (len(choices), 1))
    for w in small:
        angle = float(np.linalg.norm(w))
        if angle >= 1e-9:
            direction = carried(direction, choices @ (w / angle), angle)
    return apart(direction, after)
