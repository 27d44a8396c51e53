"""One fixture turns gyros and accelerometers alike: a bend that one sensor has and the other denies is none.

With γ̂ of the sensor that has it, and G = CᵀC, h = Cᵀz of the other beside all that is believed there, the
other is to see E² = γ̂ᵀGγ̂ and sees γ̂ᵀh: nearer to nothing than to E², the angles are the sensor's own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.diagnose.hypotheses.agreement import FORESEEN
from planner.diagnose.hypotheses.estimates import estimates
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.nouns.diagnosis import Refused
from planner.nouns.sensor import channel_name

BENDS = "mounting_by_temperature"
DENIED = "the other sensor, on the same fixture, does not turn with it"


def denied_by_the_other(found: Sequence[SensorFound]) -> list[Refused]:
    """A bend of the fixture on every sensor whose like the other does not see."""
    return [
        Refused(BENDS, tuple(channel_name(s.sensor, a) for a in sorted(s.found.axes(b))), DENIED)
        for s in found
        for b in s.found.library
        if s.found.pool.blocks[b].name == BENDS
        and any(_denies(other, _turn(s, b)) for other in found if other.sensor != s.sensor)
    ]


def _turn(s: SensorFound, b: int) -> Array:
    """γ̂ (3,) rad in the span that it is told over."""
    return np.array([e.value for e in estimates(s.found.pool, s.found.all) if e.block == b])


def _denies(s: SensorFound, turn: Array) -> bool:
    """Whether a sensor would see the turn (3,) and sees less than half of it."""
    pool = s.found.pool
    for b, block in enumerate(pool.blocks):
        if block.name == BENDS:
            here, k = s.found.without(b), pool.places[b]
            each = {a: here.seen(a, k) * (pool.size[k] * turn) for a in block.columns}
            felt = {a: C.sum(axis=1) for a, C in each.items()}
            foreseen = sum(float(x @ x) for x in felt.values())
            return foreseen > FORESEEN**2 and (
                sum(float(x @ here.state[a].z) for a, x in felt.items()) < 0.5 * foreseen
            )
    return False
