"""A bench as those know it who act on it: limits, stops and chamber in the units of controllers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

BY_HAND = "levelled_plate"  # a kind of bench without a drive: the operator is the table
Stops = tuple[float, float]


@dataclass(frozen=True)
class ChamberFacts:
    """What the chamber can do; rates in K/min, None: a change of temperature takes no time of its own."""

    coldest_degc: float
    hottest_degc: float
    heating_k_per_min: float | None = None
    cooling_k_per_min: float | None = None
    soak_s: float = 0.0


@dataclass(frozen=True)
class BenchFacts:
    """What the bench can do, None: not limited; units: how many fit on it at once; arm_m: of a centrifuge.

    travel: axis -> (least, most) deg of an axis with stops; others turn on and on
    """

    name: str
    kind: str
    axes: int
    room_degc: float
    units: int = 1
    rate_dps: float | None = None
    angular_acceleration_dps2: float | None = None
    acceleration_g: float | None = None
    arm_m: float | None = None
    chamber: ChamberFacts | None = None
    travel: Mapping[int, Stops] = field(default_factory=dict)

    @property
    def driven(self) -> bool:
        """Whether it has a drive that takes commands."""
        return self.kind != BY_HAND
