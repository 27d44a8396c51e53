"""How a spec asks to be planned: method, temperatures, repeats, objective, shifts."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, Tag

from planner.quantities import (
    Celsius,
    ClockTime,
    Count,
    CountOrNone,
    Number,
    PositiveKelvin,
    PositiveSeconds,
    Share,
    Switch,
    Weekday,
    WeekMoment,
    Whole,
)
from planner.spec.days_off import DayOff
from planner.spec.forms import (
    list_or_number,
    of_forms,
    one_or_many,
)
from planner.spec.part import SpecPart

Temperatures = Annotated[
    Annotated[Literal["room"], Tag("text")]
    | Annotated[CountOrNone, Tag("number")]
    | Annotated[tuple[Celsius, ...], Field(min_length=1), Tag("list")],
    of_forms(
        "must be room, a number of points such as 5, or a list such as [-40 degC, 20 degC]", words=("room",)
    ),
]
Repeats = Annotated[
    Annotated[CountOrNone, Tag("number")]
    | Annotated[tuple[CountOrNone, ...], Field(min_length=1), Tag("list")],
    of_forms(
        "must be a number such as 3, or a list with one per temperature such as [3, 5, 3]", list_or_number
    ),
]


class TemperatureChoice(SpecPart):
    """Which numbers of temperature points the planner may choose, over which range."""

    range: tuple[Celsius, Celsius] = Field(
        (-60.0, 60.0), description="temperatures of use, e.g. [-60 degC, 60 degC]"
    )
    candidates: tuple[Count, ...] = Field(
        (1, 3, 5, 7, 10, 12, 15, 20), min_length=1, description="numbers of points to choose from"
    )
    interpolate: Switch = Field(
        False, description="whether a residual may be read between the table's numbers"
    )
    room: Celsius = Field(20.0, description="temperature without a chamber, e.g. 20 degC")
    step: PositiveKelvin = Field(
        5.0, description="grid of the temperatures to choose from, method information, e.g. 5 K"
    )


class RepeatChoice(SpecPart):
    """How few and how many repeats the planner may choose per temperature."""

    least: Count = Field(2, description="never fewer repeats than this")
    most: Count = Field(1000, description="never more repeats than this")


class FixedTest(SpecPart):
    """A hand-made choice for one test: temperatures, and repeats for all of them or for each; 0: not used."""

    temperatures: Temperatures | None = Field(None, description="room, how many, or which")
    repeats: Repeats | None = Field(
        None, description="for all temperatures, or a list with one for each; 0: the test is not used"
    )


class Objective(SpecPart):
    """Weights of the two costs of a campaign: its duration and the power-on time of the unit."""

    time: Annotated[Number, Field(ge=0)] = Field(1.0, description="weight of an hour of the campaign")
    power_on: Annotated[Number, Field(ge=0)] = Field(0.0, description="weight of an hour of the unit's life")


class Genetic(SpecPart):
    """Settings of the genetic algorithm; the defaults are K 3.4.3."""

    individuals: Annotated[Count, Field(ge=4, le=100_000)] = Field(256, description="size of the population")
    best: Annotated[Count, Field(ge=2)] = Field(32, description="how many are selected as parents")
    crossover: Annotated[Number, Field(ge=0, le=1)] = Field(0.5, description="probability of crossover")
    mutation: Annotated[Number, Field(ge=0, le=1)] = Field(0.01, description="probability of mutation")
    generations: Annotated[Count, Field(le=100_000)] = Field(500, description="at most so many generations")
    bits: Annotated[Count, Field(le=52)] = Field(
        16, description="of a gene, one gene an error; K has 32 in a chromosome, 8 for each of four errors"
    )
    patience: Count = Field(50, description="generations without gain after which it has converged")
    tolerance: Annotated[Number, Field(ge=0, lt=1)] = Field(
        1e-4, description="gain that counts as none, a share of the best value"
    )


ObjectiveChoice = Annotated[
    Annotated[Literal["time", "power_on"], Tag("text")] | Annotated[Objective, Tag("mapping")],
    of_forms("must be time, power_on, or weights such as {time: 1, power_on: 2}", words=("time", "power_on")),
]


class Shift(SpecPart):
    """Hours in which people work; until 06:00 after from 22:00 is the next morning, 24:00 is midnight."""

    days: Annotated[tuple[Weekday, ...], BeforeValidator(one_or_many)] = Field(
        ("mon", "tue", "wed", "thu", "fri"), min_length=1, description="on which days, e.g. [mon, tue]"
    )
    opens: ClockTime = Field(alias="from", description="when work begins, e.g. 08:00")
    closes: ClockTime = Field(alias="to", description="when work ends, e.g. 17:00")
    start: WeekMoment | None = Field(
        None,
        description="when the campaign starts, e.g. mon 08:00, or 2026-12-21 08:00; default: when the first "
        "shift begins",
    )
    holidays: Annotated[tuple[DayOff, ...], BeforeValidator(one_or_many)] = Field(
        (),
        description="days on which nobody works, in any shift: [2026-12-24, 2026-12-28..2027-01-01, DE-BY]; "
        "'start' then has a date",
    )


class PlanChoice(SpecPart):
    """How to plan."""

    method: Literal["information", "published"] = Field(
        "information",
        description="information: what all records together leave in flight; published: each error on its "
        "own, by K's confidence intervals. worst_case and given sensitivities: always published",
    )
    temperature_estimator: Literal["lines", "smooth"] = Field(
        "lines", description="of the tables over temperature: straight lines, or the smooth posterior mean"
    )
    redundancy: Annotated[Whole, Field(le=1)] = Field(
        1, description="1: no error rests on a single record; 0: it may"
    )
    confidence: Share = Field(0.95, description="of the interval that the repeats must give, e.g. 95 %")
    quantile: Literal["student", "normal"] = Field(
        "student",
        description="student: right for few repeats, with drift and noise between the records; "
        "normal: as published, with the run-to-run spread alone",
    )
    temperatures: TemperatureChoice = Field(
        default_factory=TemperatureChoice, description="temperature points to choose from"
    )
    repeats: RepeatChoice = Field(default_factory=RepeatChoice, description="repeats to choose from")
    minimise: ObjectiveChoice = Field("time", description="what is made least: time, power_on or weights")
    fixed: dict[str, FixedTest] = Field(
        default_factory=dict, description="test: hand-made choice that is timed instead of optimised"
    )
    genetic: Genetic = Field(default_factory=Genetic, description="settings of the genetic algorithm")
    order: Literal["free", "up", "down", "up_and_down"] = Field(
        "free", description="of the temperatures: free (shortest), up, down (hysteresis), up_and_down"
    )
    shifts: Annotated[tuple[Shift, ...], BeforeValidator(one_or_many)] = Field(
        (), description="hours in which people work, e.g. {days: [mon, tue], from: 08:00, to: 17:00}"
    )
    overlap: Annotated[tuple[Literal["cool_down"], ...], BeforeValidator(one_or_many)] = Field(
        (), description="[cool_down]: the last cool-down at a temperature runs during the next ramp and soak"
    )
    units: Annotated[Count, Field(le=10_000)] | None = Field(
        None, description="how many units to calibrate, in batches that fit the benches"
    )
    trade_off: Switch = Field(
        False, description="whether to plan again for other weights of time and power-on time"
    )
    seed: Whole = Field(1, description="of every random number; the same seed gives the same bytes")
    proof: Literal["quick", "thorough"] = Field(
        "quick", description="that none is shorter: of a second or so, or thorough, within time_limit"
    )
    time_limit: PositiveSeconds = Field(120.0, description="longest time for the proof, e.g. 2 min")
