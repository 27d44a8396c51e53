"""A centrifuge: an arm that turns at a known rate and loads the unit at its end, a = R ω² (K 4.3.3).

Loads are signed along the unit's axis: a negative one means the unit turned round on the arm. On an arm of
one axis the operator remounts the unit after each third of the motions, so that every axis is loaded. Of two
or more axes, axis 2 turns the unit at the arm's end and brings its x, y, −x, −y outwards: z is never loaded.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle, islice, product

import numpy as np

from planner.benches._excitation import LOADS_G, Bench, Motion, chosen


class Centrifuge(Bench):
    """Excites acceleration together with rate, gravity (by mounting) and, with a chamber, temperature."""

    name = "centrifuge"
    excites = frozenset({"rate", "gravity", "acceleration", "temperature"})

    def motions(
        self,
        count: int,
        axes: int,
        *,
        calibrates: Sequence[str] = (),
        rate_limit_dps: float = np.inf,
        load_limit_g: float = np.inf,
    ) -> tuple[Motion, ...]:
        """Loads of K 2.2.5 in both directions of the unit's axes, lowest first; one is a middle load.

        24 motions on one axis are 3 mountings × 4 loads × 2 directions.
        """
        if axes == 1:
            return tuple(motion for share in _mountings(count) for motion in _both_ways(share, load_limit_g))
        loads = chosen(LOADS_G, -(-count // 4), load_limit_g)
        motions = [
            {"acceleration_g": load, "position_2_deg": position}
            for load, position in product(loads, (0.0, 90.0, 180.0, 270.0))
        ]
        return tuple(islice(cycle(motions), count))


def _mountings(count: int) -> list[int]:
    """How many motions each mounting of the unit has: thirds of them, or all in one for fewer than three."""
    if count < 3:
        return [count]
    return [sum(3 * k // count == third for k in range(count)) for third in range(3)]


def _both_ways(count: int, limit_g: float) -> list[Motion]:
    """`count` loads in one mounting: each level in both directions."""
    loads = chosen(LOADS_G, -(-count // 2), limit_g)
    motions = [{"acceleration_g": sign * load} for load, sign in product(loads, (1.0, -1.0))]
    return list(islice(cycle(motions), count))


KIND = Centrifuge()
