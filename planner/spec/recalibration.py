"""What may be done to a unit in store, between two calibrations on the bench."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from planner.quantities import Count, PositiveAngle, PositiveSeconds, Seconds
from planner.spec.part import SpecPart


class Recalibration(SpecPart):
    """What may be done in store: faces on a levelled surface, turns by hand through known angles.

    No chamber and no rate table: what only they can excite stays as it is. Accuracies are one sigma.
    """

    headings: Annotated[Count, Field(le=2)] = Field(
        2, description="how often each of the six faces rests: 2 is again after half a turn on the surface"
    )
    rest: PositiveSeconds = Field(60.0, description="how long one rest is recorded, e.g. 5 min")
    turns: Count = Field(1, description="whole turns about each axis and each way of one repeat")
    turn: PositiveSeconds = Field(20.0, description="how long one whole turn by hand takes, e.g. 20 s")
    angle_error: PositiveAngle = Field(
        0.0008726646259971648, description="how well the angle of the turns is known, e.g. 0.05 deg"
    )
    level: PositiveAngle = Field(
        0.0017453292519943296, description="how well surface and faces are levelled, e.g. 0.1 deg"
    )
    set_up: Seconds = Field(600.0, description="time before the first power-on, e.g. 10 min")
    move: Seconds = Field(10.0, description="time to put it on the next face, e.g. 10 s")
    power_on: Seconds = Field(30.0, description="from power-on until the first record, e.g. 30 s")
    cool_down: Seconds = Field(600.0, description="power off after every repeat, e.g. 10 min")
    units: Annotated[Count, Field(le=1000)] = Field(
        1, description="how many units rest side by side on the surface; turns are one after another"
    )
    working_day: PositiveSeconds = Field(
        28_800.0, description="hours of work on one day, e.g. 8 h; which days: those of plan.shifts"
    )
    repeats: Annotated[Count, Field(le=100)] = Field(
        20, description="never more power-ons of one visit than this"
    )
    period: PositiveSeconds = Field(
        31_536_000.0, description="how long recalibrations in store must carry the unit, e.g. 365 d"
    )
