"""A rate table, of one axis or more: holds the unit in any attitude and turns it at known rates.

Of two or more axes, axis 1 carries the unit and axis 2 tilts axis 1. At zero the unit's z axis points up
along axis 1, and axis 2 is the unit's y axis. So body z turns by axis 1, body y by axis 2, body x by axis 2
with axis 1 at 90 deg; at positions p1, p2 up is (−sin p2 cos p1, sin p2 sin p1, cos p2) in the body.
A table of one axis cannot turn over: the operator remounts the unit between its motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle, islice, product

import numpy as np

from planner.benches._excitation import RATES_DPS, Bench, Motion, chosen, directions, pointing_up
from planner.catalog import effects


class RateTable(Bench):
    """Excites rate, gravity (by attitude) and, in its chamber, temperature; never more than 1 g."""

    name = "rate_table"
    excites = frozenset({"rate", "gravity", "temperature"})

    def motions(
        self,
        count: int,
        axes: int,
        *,
        calibrates: Sequence[str] = (),
        rate_limit_dps: float = np.inf,
        load_limit_g: float = np.inf,
    ) -> tuple[Motion, ...]:
        """Rests for bias and accelerometers, turns for scale factor and misalignment of gyros.

        30 turns are 3 axes × 2 directions × 5 rates, 6 rests are the faces of a cube; further rests are its
        edges and corners. Without `calibrates` more than six motions are turns. One rest is at zero.
        """
        turning = any(_needs_turns(error) for error in calibrates) if calibrates else count > 6
        motions = _turns(count, axes, rate_limit_dps) if turning else _rests(axes)
        return tuple(islice(cycle(motions), count))


def _needs_turns(error: str) -> bool:
    """Whether the error enters by the rate: the table cannot show it at rest."""
    sensor, _, name = error.partition(".")
    effect = effects().get(name)
    if sensor != "gyro" or effect is None:
        return False
    return effect.group != "bias" or ("rate" in effect.needs and not effect.bench_only)


def _rests(axes: int) -> list[Motion]:
    if axes == 1:
        return [{"position_1_deg": position} for position in (0.0, 90.0, 180.0, 270.0)]
    return [pointing_up(direction) for direction in directions()]


def _turns(count: int, axes: int, limit_dps: float) -> list[Motion]:
    if axes == 1:
        rates = chosen(RATES_DPS, -(-count // 2), limit_dps)
        return [{"rate_1_dps": sign * rate} for rate, sign in product(rates, (1.0, -1.0))]
    about = (
        {"position_1_deg": 90.0, "rate_2_dps": 1.0},
        {"position_1_deg": 0.0, "rate_2_dps": 1.0},
        {"position_2_deg": 0.0, "rate_1_dps": 1.0},
    )
    rates = chosen(RATES_DPS, -(-count // 6), limit_dps)
    return [
        {key: value * sign * rate if key.startswith("rate") else value for key, value in axis.items()}
        for axis, rate, sign in product(about, rates, (1.0, -1.0))
    ]


KIND = RateTable()
