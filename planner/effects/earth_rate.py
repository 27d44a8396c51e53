"""The Earth's rate, left out of the bench's reference: y += Ω sin φ · up + Ω cos φ · level (K 2.2.2, eq. 1).

No fault of the unit: a reference that says zero at rest, or has the rate with the wrong sign and is off by
twice as much. `up` is along gravity's reaction, on a centrifuge along its axis. A dwell table does not say
where north is; on the cube of a levelled plate it is taken along the next axis in cyclic order after the one
that is vertical, as in the usual set-up, and `east` takes up a fixture that is turned. The `…_inverted` parts
are for fixtures that turn a unit over about the other axis, so that north changes sign with the face. Where
the faces are turned one by one, the up term alone carries the effect. While the unit turns the horizontal
part averages out.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.effects._bench_frame import turning, upwards
from planner.effects._channels import BaseEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.physics.earth import EARTH_RATE_RADPS
from planner.protocols import Condition, Group, Sensor, Term

PARTS = ("up", "north", "east", "north_inverted", "east_inverted")
_STRAIGHT = 0.98  # cosine of an axis with the vertical, above which the face counts as level


class EarthRate(BaseEffect):
    """Ω sin φ and the two parts of Ω cos φ, shared by the three gyros: 15.04 deg/h, of a wrong sign twice."""

    name = "earth_rate"
    sensors: tuple[Sensor, ...] = ("gyro",)
    units: Mapping[Sensor, str] = {"gyro": "deg/s"}
    group: Group = "bias"
    needs = frozenset[Condition](("rate", "specific_force"))
    largest: Mapping[Sensor, float] | None = {"gyro": 2.0 * EARTH_RATE_RADPS}
    misfit = 0.35  # where north is no table says; the horizontal part is 0.31 of the whole at 56°
    title = "the Earth's rate, left out of the reference or of the wrong sign"
    equation = "y += Ω sin φ · up + Ω cos φ (cos α · north + sin α · east)"
    source = "K 2.2.2, eq. 1"
    bench_only = True

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """The vertical part, and the horizontal one along the fixture's axis and across it."""
        return tuple(Term(part, channels=(0, 1, 2)) for part in PARTS)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(n, 3, 5) unit vectors up and, at rest on a level face, north and east as the fixture has them."""
        up = upwards(conditions)
        level = (np.abs(up) > _STRAIGHT) & ~turning(conditions)[:, np.newaxis]
        north = np.roll(level.astype(float), 1, axis=1)
        over = np.sign(np.sum(up * level, axis=1, keepdims=True))
        east = np.cross(north, up)
        return np.stack([up, north, east, over * north, over * east], axis=2)


EFFECT = EarthRate()
