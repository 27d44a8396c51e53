"""Spec → what bench software must know of the benches: axes, limits, chamber."""

from __future__ import annotations

from planner.nouns.plan import PlannedBench, PlannedChamber
from planner.spec.model import Chamber, Spec


def planned_benches(spec: Spec) -> tuple[PlannedBench, ...]:
    """The benches of the spec, in its order."""
    return tuple(
        PlannedBench(
            name=name,
            kind=bench.kind or name,
            axes=bench.axes,
            units=bench.units,
            room_degc=spec.plan.temperatures.room,
            rate=bench.limits.rate,
            angular_acceleration=bench.limits.angular_acceleration,
            acceleration=bench.limits.acceleration,
            arm=bench.arm,
            chamber=None if bench.chamber is None else _chamber(bench.chamber),
            travel=dict(sorted(bench.limits.travel.items())),
        )
        for name, bench in spec.benches.items()
    )


def _chamber(chamber: Chamber) -> PlannedChamber:
    coldest, hottest = chamber.range
    return PlannedChamber(coldest, hottest, chamber.heating, chamber.cooling, chamber.soak)
