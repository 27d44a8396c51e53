"""What chance does to a campaign beside the spec's budgets: noise of the records, the chamber's stray.

Where the spec has no `unit.noise`, records are as noisy as `planner simulate` makes them by default; a test
holds these figures to its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from planner.protocols import SENSORS, Sensor
from planner.spec.model import Spec
from planner.units import to_si

DEFAULT_DENSITY: Mapping[Sensor, str] = {"gyro": "0.003 deg/s", "accelerometer": "0.1 mg"}  # of 1 s


@dataclass(frozen=True)
class Chance:
    """How to draw, SI.

    white: noise density of each sensor, per root hertz (a record of T seconds has white/√T)
    flown: sensors whose noise the spec gives: that noise acts in flight, too
    temperature_jitter: how far a soaked chamber strays, K
    case: `random` draws sizes within the budget, `worst` takes all of it; signs: `random` or `plus`
    """

    white: Mapping[Sensor, float] = field(
        default_factory=lambda: {s: to_si(DEFAULT_DENSITY[s], _PER[s]) for s in SENSORS}
    )
    flown: frozenset[Sensor] = frozenset()
    temperature_jitter: float = 0.05
    case: Literal["random", "worst"] = "random"
    signs: Literal["random", "plus"] = "random"


_PER: Mapping[Sensor, str] = {"gyro": "deg/s", "accelerometer": "g"}


def chance_of(spec: Spec) -> Chance:
    """Chance with the spec's noise; a sensor for which it has none keeps the default, on the bench alone."""
    given: frozenset[Sensor] = frozenset(s for s in SENSORS if getattr(spec.unit.noise, s) is not None)
    start = Chance()
    white = {s: spec.unit.white(s) if s in given else start.white[s] for s in SENSORS}
    return Chance(white=white, flown=given)
