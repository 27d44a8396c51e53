"""What benches act on in plan.json: the benches with their limits, and the steps.

Units stand in the keys. Both come out as the records of `planner.nouns`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from planner.nouns.bench import BenchFacts, ChamberFacts
from planner.nouns.step import Action, Step

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Time = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Moment = Annotated[float, Field(ge=0, le=1e10, allow_inf_nan=False)]  # three centuries: calendars hold it
Count = Annotated[int, Field(ge=1, le=10**9)]
MotionKey = Literal[
    "position_1_deg",
    "position_2_deg",
    "position_3_deg",
    "position_4_deg",
    "position_5_deg",
    "position_6_deg",
    "rate_1_dps",
    "rate_2_dps",
    "rate_3_dps",
    "rate_4_dps",
    "rate_5_dps",
    "rate_6_dps",
    "acceleration_g",
]
if TYPE_CHECKING:
    Motion = dict[str, float]
    Travel = dict[str, list[float]]
else:
    Motion = dict[MotionKey, Number]
    Travel = dict[
        Literal["1", "2", "3", "4", "5", "6"], Annotated[list[Number], Field(min_length=2, max_length=2)]
    ]


class BenchPart(BaseModel):
    """Base of what benches act on: a key that is unknown here could be an order that is not obeyed."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Limits(BenchPart):
    """What the bench can do at most; null: not limited. travel_deg: axis -> its stops [least, most]."""

    rate_dps: Positive | None
    angular_acceleration_dps2: Positive | None
    acceleration_g: Positive | None
    travel_deg: Travel = {}


class ChamberRow(BenchPart):
    """The bench's chamber; null speeds: a change of temperature takes no time of its own."""

    coldest_degc: Number
    hottest_degc: Number
    heating_k_per_min: Positive | None
    cooling_k_per_min: Positive | None
    soak_s: Time


class BenchRow(BenchPart):
    """A bench as bench software must know it; `units` fit on it at once, `arm_m` is a centrifuge's."""

    kind: str
    axes: Annotated[int, Field(ge=1, le=6)]
    units: Count
    room_degc: Number
    arm_m: Positive | None
    limits: Limits
    chamber: ChamberRow | None

    def named(self, name: str) -> BenchFacts:
        """The record."""
        limits, chamber = self.limits, self.chamber
        return BenchFacts(
            name=name,
            kind=self.kind,
            axes=self.axes,
            room_degc=self.room_degc,
            units=self.units,
            rate_dps=limits.rate_dps,
            angular_acceleration_dps2=limits.angular_acceleration_dps2,
            acceleration_g=limits.acceleration_g,
            arm_m=self.arm_m,
            chamber=None if chamber is None else ChamberFacts(**vars(chamber)),
            travel={int(axis): (least, most) for axis, (least, most) in limits.travel_deg.items()},
        )


class StepRow(BenchPart):
    """One action on one bench; times in seconds from the start of the campaign.

    attended: whether a person must be there; null: an older plan does not say
    temperature_rate_degc_min: how fast the chamber moves meanwhile, where a test records on a ramp;
        temperature_degc is then that of a record's middle, of a ramp's end
    """

    id: str = Field(min_length=1)
    bench: str
    action: Action
    start_s: Moment
    end_s: Moment
    test: str | None
    temperature_degc: Number | None
    repeat: Count | None
    motion: Motion | None
    units: Count
    attended: bool | None = None
    temperature_rate_degc_min: Number | None = None


if TYPE_CHECKING:
    Steps = tuple[Step, ...]
    Benches = dict[str, BenchFacts]
else:
    Steps = Annotated[list[StepRow], AfterValidator(lambda rows: tuple(Step(**vars(row)) for row in rows))]
    Benches = Annotated[
        dict[str, BenchRow],
        AfterValidator(lambda rows: {name: row.named(name) for name, row in rows.items()}),
    ]
