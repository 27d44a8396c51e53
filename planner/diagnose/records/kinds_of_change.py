"""What a reference may become in mid-campaign: kinds of changes, and what one unit of each is felt as.

mounting   d_j = e_j × u of both sensors
tilt       g · north, g · east of the accelerometers, at rest
azimuth    |Ω_h| · north, |Ω_h| · east of the gyros, at rest
scale      u of both sensors (the read-out), of the gyros (the table), of the accelerometers (gravity)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.diagnose.references.bench_directions import at_rest, horizontal, loaded
from planner.diagnose.references.references import MOST_SCALE, REFERENCES, Reference
from planner.measurement import sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import SENSORS, Sensor
from planner.units import STANDARD_GRAVITY_MPS2

DAYS = 1.0  # from which on a base is said to settle
MOST_RAD = 0.1  # 6 deg, beyond which θ × u is no rotation
MOST_SHARE = 3.0  # of the horizontal rate: north that is south is 2

Felt = Callable[[Sensor, Conditions], list[Array]]


@dataclass(frozen=True)
class Kind:
    """A hypothesis about a reference that may begin in mid-campaign.

    felt: what one unit of each coefficient adds to the true input, (n, 3) each; most: their length can be
    where: in words; said: how unit or bench would then stand, with blanks for the coefficients
    alone: whether it is told of single power-ons too (a mounting of one is `off_power_on`'s), and of whole
        campaigns by the search; drifts: whether it grows from day to day, in all power-ons
    """

    name: str
    sensors: tuple[Sensor, ...]
    felt: Felt
    most: float
    where: str
    said: str
    alone: bool = False
    drifts: bool = False

    @property
    def searched(self) -> bool:
        """Whether a search of all records has the same, which this one then replaces."""
        return self.alone or self.drifts

    @property
    def reference(self) -> Reference:
        """What is known of it."""
        return REFERENCES.get(self.name, GAIN)


def mounted(sensor: Sensor, conditions: Conditions) -> list[Array]:
    """e_j × u off the centrifuge, which has a mounting of its own: (n, 3) each."""
    here = ~loaded(conditions)
    u = sensed(sensor, conditions) * here[:, None]
    return [np.cross(e, u) for e in np.eye(3)]


def mounted_on_the_arm(sensor: Sensor, conditions: Conditions) -> list[Array]:
    """e_j × u on the centrifuge: (n, 3) each."""
    u = sensed(sensor, conditions) * loaded(conditions)[:, None]
    return [np.cross(e, u) for e in np.eye(3)]


def mounted_at_rest(sensor: Sensor, conditions: Conditions) -> list[Array]:
    """e_j × u at rest: (n, 3) each."""
    u = sensed(sensor, conditions) * at_rest(conditions)[:, None]
    return [np.cross(e, u) for e in np.eye(3)]


def tilted(sensor: Sensor, conditions: Conditions) -> list[Array]:
    """g · north and g · east at rest: (n, 3) each."""
    still = at_rest(conditions)[:, None]
    return [STANDARD_GRAVITY_MPS2 * still * v for v in horizontal(conditions)]


def tilting(sensor: Sensor, conditions: Conditions) -> list[Array]:
    """The same in proportion to the days since the first record, 1 at the last: (n, 3) each."""
    since = conditions.day - conditions.day.min()
    share = since / max(float(since.max()), DAYS)
    return [share[:, None] * d for d in tilted(sensor, conditions)]


def turned_from_north(sensor: Sensor, conditions: Conditions) -> list[Array]:
    """|Ω_h| · north and |Ω_h| · east at rest: (n, 3) each."""
    still = at_rest(conditions)[:, None]
    north, east = horizontal(conditions)
    size = np.abs(np.sum(north * conditions.rate, axis=1, keepdims=True)) * still
    return [size * north, size * east]


def scaled(sensor: Sensor, conditions: Conditions) -> list[Array]:
    """u off the centrifuge: (n, 3)."""
    return [sensed(sensor, conditions) * ~loaded(conditions)[:, None]]


def read_out(sensor: Sensor, conditions: Conditions) -> list[Array]:
    """u of all records: (n, 3)."""
    return [sensed(sensor, conditions)]


GAIN = Reference(
    "mixed_units", SENSORS, "1", ("scale",), lambda c, table, place: sensed(c.sensor, table.conditions()),
    "compare the gain or the range of the read-out before and after",
)  # fmt: skip
_ANEW = (
    "look up whether the unit was mounted anew {before}: {where}{there} it is turned by {sizes} deg about "
    "x, y and z on all channels alike"
)
KINDS = (
    Kind("mounting", ("gyro", "accelerometer"), mounted, MOST_RAD, "", _ANEW),
    Kind("mounting", ("gyro", "accelerometer"), mounted_at_rest, MOST_RAD, "at rest, ", _ANEW),
    Kind("mounting", ("gyro", "accelerometer"), mounted_on_the_arm, MOST_RAD, "on the centrifuge, ", _ANEW),
    Kind(
        "base_tilt", ("accelerometer",), tilted, MOST_RAD, "",
        "look up whether the base settled or was levelled anew: {when} it leans by {sizes} deg along north "
        "and east",
        alone=True,
    ),
    Kind(
        "base_tilt", ("accelerometer",), tilting, MOST_RAD, "",
        "look up whether the base settles: {when} it leans by {sizes} deg along north and east at last",
        drifts=True,
    ),
    Kind(
        "mixed_units", SENSORS, read_out, MOST_SCALE, "",
        "look up what was changed at the read-out of all channels: {when} they read by {sizes} of their "
        "input more",
    ),
    Kind(
        "table_rate", ("gyro",), scaled, MOST_SCALE, "",
        "look up what was changed at the table: {when} it turns by {sizes} of its rate faster than the "
        "reference says",
    ),
    Kind(
        "local_gravity", ("accelerometer",), scaled, MOST_SCALE, "",
        "look up whether the bench was moved: {when} gravity is larger by {sizes} of it",
    ),
    Kind(
        "azimuth", ("gyro",), turned_from_north, MOST_SHARE, "",
        "look up whether the fixture was turned: {when} {sizes} of the Earth's horizontal rate act along "
        "north and east beside the reference",
        alone=True,
    ),
)  # fmt: skip
WITHIN_POWER_ONS = (
    scaled,
    read_out,
    mounted,
    mounted_on_the_arm,
    tilted,
    tilting,
)  # turns and faces tell these
