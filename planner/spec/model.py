"""The frozen typed spec. Every field's unit is in its type (`quantities`); SI and degrees Celsius inside.

What one field alone cannot tell (an effect's dimension, a temperature outside the chamber) is found by
`planner.spec.rules`, with the place in the file.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, Tag

from planner.protocols import Sensor
from planner.quantities import (
    DAY_S,
    Acceleration,
    Angle,
    AnyQuantity,
    Celsius,
    Count,
    CountOrNone,
    KelvinPerSecond,
    PositiveAcceleration,
    PositiveAngularAcceleration,
    PositiveMetres,
    PositiveRate,
    PositiveSeconds,
    Rate,
    Seconds,
    Share,
    Switch,
)
from planner.spec.budget import ErrorBudget
from planner.spec.flight_temperature import FlightTemperature
from planner.spec.forms import (
    Name,
    first_format,
    list_or_number,
    moment,
    no_list,
    of_forms,
    one_or_many,
)
from planner.spec.noise_density import AccelerometerNoise, GyroNoise, usual
from planner.spec.part import SpecPart
from planner.spec.plan_choice import PlanChoice, Temperatures
from planner.spec.ramp import WAYS, Ramp
from planner.spec.recalibration import Recalibration
from planner.spec.references import BenchAccuracy, InitialAlignment, Vertical

NAVIGATION_ERRORS = {
    "position": "m",
    "horizontal": "m",
    "north": "m",
    "east": "m",
    "up": "m",
    "velocity": "m/s",
    "attitude": "deg",
    "roll_pitch": "deg",
    "heading": "deg",
}


class PercentileRule(SpecPart):
    """The exact percentile of the length of the Gaussian error vector."""

    percentile: Share = Field(description="share of the flights that must keep the limit, e.g. 95 %")


_RuleName = Annotated[Literal["worst_case", "rss"], Tag("text")]
RequirementRule = Annotated[
    _RuleName | Annotated[PercentileRule, Tag("mapping")],
    of_forms("must be worst_case, rss or {percentile: 95 %}", words=("worst_case", "rss")),
]
Moment = Annotated[
    Annotated[Literal["end", "any"], Tag("word")] | Annotated[PositiveSeconds, Tag("time")],
    of_forms("must be end, any, or a time such as 30 s", moment),
]


class Requirement(SpecPart):
    """What the navigation must achieve: `{error: position, limit: 10 m, rule: worst_case, at: end}`."""

    error: Literal[
        "position", "horizontal", "north", "east", "up", "velocity", "attitude", "roll_pitch", "heading"
    ] = Field(description="which navigation error: its length, or one component of it")
    limit: AnyQuantity = Field(description="the largest error allowed, e.g. 10 m, 2 m/s, 0.5 deg")
    rule: RequirementRule = Field(
        "worst_case",
        description="worst_case: moduli add; rss: squares add; {percentile: 95 %}: share of all flights",
    )
    at: Moment = Field("end", description="end of the flight, any moment of it, or a time such as 30 s")
    temperature: FlightTemperature = Field(
        "range",
        description="where the flights start: anywhere in plan.temperatures.range, at the worst temperature "
        "of it, as the trajectory has it (flight), or {distribution: {20 degC: 0.7, 60 degC: 0.3}}",
    )


class Noise(SpecPart):
    """White noise of the sensors; a record of t seconds scatters by it over √t.

    Left out: records have that of a small unit, 0.003 deg/s and 0.1 mg per root hertz, the flight has none.
    """

    gyro: GyroNoise | None = Field(None, description="angle random walk, e.g. 0.1 deg/sqrt(h)")
    accelerometer: AccelerometerNoise | None = Field(
        None, description="velocity random walk, e.g. 0.05 m/s/sqrt(h), or 100 micro-g/sqrt(Hz)"
    )


class Unit(SpecPart):
    """The inertial unit: sensor -> effect name -> budget."""

    service_life: PositiveSeconds | None = Field(
        None, description="power-on hours the sensors live, e.g. 500 h"
    )
    noise: Noise = Field(
        default_factory=Noise, description="white noise of the sensors, e.g. {gyro: 0.1 deg/sqrt(h)}"
    )
    gyro: dict[str, ErrorBudget] = Field(default_factory=dict, description="effect: budget, of each gyro")
    accelerometer: dict[str, ErrorBudget] = Field(
        default_factory=dict, description="effect: budget, of each accelerometer"
    )

    def white(self, sensor: str) -> float:
        """Noise density of a sensor, SI per √Hz; 0 where the spec has none."""
        return self._noise(sensor) or 0.0

    def white_of_records(self, sensor: Sensor) -> float:
        """Noise density of a sensor's records, SI per √Hz; where the spec has none, that of a small unit.

        Records without any noise would tell a scale factor by the Earth's rate.
        """
        found = self._noise(sensor)
        return usual(sensor) if found is None else found

    def _noise(self, sensor: str) -> float | None:
        return self.noise.gyro if sensor == "gyro" else self.noise.accelerometer


class Chamber(SpecPart):
    """The chamber of a bench; without heating and cooling rates a change of temperature takes no time."""

    range: tuple[Celsius, Celsius] = Field(description="coldest and hottest, e.g. [-65 degC, 85 degC]")
    heating: KelvinPerSecond | None = Field(None, description="how fast it heats, e.g. 4 K/min")
    cooling: KelvinPerSecond | None = Field(None, description="how fast it cools, e.g. 2 K/min")
    soak: Seconds = Field(0.0, description="wait at a new temperature until the unit has it, e.g. 30 min")


class BenchLimits(SpecPart):
    """What the bench can do at most; absent means not limited."""

    rate: PositiveRate | None = Field(None, description="fastest rate of an axis, e.g. 600 deg/s")
    angular_acceleration: PositiveAngularAcceleration | None = Field(None, description="e.g. 500 deg/s/s")
    acceleration: PositiveAcceleration | None = Field(None, description="largest load, e.g. 100 g")
    travel: dict[Annotated[Count, Field(le=6)], tuple[Angle, Angle]] = Field(
        default_factory=dict, description="stops of an axis that has some, e.g. {2: [-95 deg, 95 deg]}"
    )


class Bench(SpecPart):
    """A bench: `kind` is a kind of bench by name (default: the bench's own name if that is a kind)."""

    kind: str | None = Field(None, description="kind of bench; default: the bench's own name")
    axes: Annotated[Count, Field(le=6)] = Field(1, description="how many axes turn")
    units: Count = Field(1, description="how many units fit on it at once")
    count: Count = Field(1, description="how many there are of it; several take loads of units in turn")
    install: Seconds = Field(0.0, description="time to put the units on, e.g. 30 min")
    remove: Seconds = Field(0.0, description="time to take the units off, e.g. 10 min")
    move: Seconds = Field(0.0, description="time from one motion to the next, e.g. 10 s")
    attended: Switch | None = Field(None, description="whether people install and remove; default: they do")
    limits: BenchLimits = Field(default_factory=BenchLimits, description="what it can do at most")
    chamber: Chamber | None = Field(None, description="its thermal chamber; without one: room temperature")
    arm: PositiveMetres | None = Field(None, description="arm of a centrifuge, e.g. 1.5 m")
    accuracy: BenchAccuracy = Field(
        default_factory=BenchAccuracy,
        description="how well its references are known, one sigma; default: perfectly",
    )


class Motion(SpecPart):
    """One motion: where an axis is held, how fast it turns, or the load of a centrifuge."""

    position_1: Angle | None = Field(None, description="where axis 1 is held, e.g. 90 deg")
    position_2: Angle | None = Field(None, description="where axis 2 is held, e.g. 90 deg")
    rate_1: Rate | None = Field(None, description="how fast axis 1 turns, e.g. 100 deg/s")
    rate_2: Rate | None = Field(None, description="how fast axis 2 turns, e.g. 100 deg/s")
    acceleration: Acceleration | None = Field(None, description="load of a centrifuge, e.g. 50 g")


Motions = Annotated[
    Annotated[Count, Tag("number")] | Annotated[tuple[Motion, ...], Field(min_length=1), Tag("list")],
    of_forms(
        "must be a number of motions such as 6, or a list such as [{position_1: 0 deg}, {rate_1: 100 deg/s}]",
        list_or_number,
    ),
]
TestTemperature = Annotated[
    Annotated[Literal["soak"], Tag("text")] | Annotated[Ramp, Tag("mapping")],
    of_forms("must be soak, or {ramp: 1 K/min}", words=("soak",)),
]


class Test(SpecPart):
    """A test: which errors its records calibrate, and what one repeat costs.

    One repeat is one power-on: `power_on` until the first record may start, then for every motion a move of
    the bench, a record and a gap; the unit is off during the last gap and the `cool_down` that follows it.
    `repeats` and `temperatures` fix what the planner would choose.
    """

    __test__ = False  # not a pytest class

    bench: Annotated[
        str, no_list("must be a bench, or two or more to choose from such as [rate_table, table_2]")
    ] = Field(description="on which of the benches")
    calibrates: Annotated[tuple[str, ...], BeforeValidator(one_or_many)] = Field(
        (), description="errors that one record serves, e.g. [gyro.bias, accelerometer.bias]"
    )
    motions: Motions = Field(1, description="records of one repeat: how many, or each motion in words")
    record: Annotated[
        PositiveSeconds, no_list("must be a time such as 300 s, or a shortest and a longest, [60 s, 5 min]")
    ] = Field(description="how long one record takes, e.g. 300 s")
    gap: Seconds = Field(0.0, description="wait after every record, e.g. 15 min to cool down, power off")
    power_on: Seconds = Field(0.0, description="from power-on until the first record may start, e.g. 30 s")
    cool_down: Seconds = Field(0.0, description="power off after every repeat, beside the gap, e.g. 15 min")
    temperatures: Temperatures | None = Field(
        None, description="room, how many, or which; left out: the planner chooses"
    )
    temperature: TestTemperature = Field(
        "soak",
        description="soak: records at a steady temperature; {ramp: 1 K/min}: while the chamber moves through "
        "it, each motion once up and once down",
    )
    repeats: CountOrNone | None = Field(
        None, description="repeats per temperature, 0: it is not used; left out: the planner chooses"
    )
    attended: Switch | None = Field(
        None,
        description="whether its power-ons and moves need people; default: moves that turn the unit by hand",
    )

    @property
    def motion_count(self) -> int:
        """How many records one repeat makes: of every motion one, on a ramp one up and one down."""
        return self.different_motions * (1 if self.ramp is None else len(WAYS))

    @property
    def different_motions(self) -> int:
        """How many motions the spec gives it."""
        return self.motions if isinstance(self.motions, int) else len(self.motions)

    @property
    def ramp(self) -> Ramp | None:
        """How the chamber moves during its records; None: it is soaked."""
        return self.temperature if isinstance(self.temperature, Ramp) else None


class Given(SpecPart):
    """Published coefficients instead of simulated ones: `{gyro.bias: 578.5 m/(deg/s)}`, all axes together."""

    given: dict[str, AnyQuantity] = Field(
        min_length=1, description="error: metres per unit of it, e.g. {gyro.bias: 578.5 m/(deg/s)}"
    )


Source = Annotated[
    Annotated[Literal["simulated"], Tag("text")] | Annotated[Given, Tag("mapping")],
    of_forms("must be simulated, or {given: {gyro.bias: 578.5 m/(deg/s), …}}", words=("simulated",)),
]
Flight = Annotated[
    Annotated[str, Tag("text")] | Annotated[dict[str, Any], Tag("mapping")],
    of_forms("must be a name such as small_uav_1, {name: level, duration: 10 min}, or {file: flight.csv}"),
]


class Spec(SpecPart):
    """A whole spec. `trajectory` is a name, `{name: …}` with parameters, or `{file: flight.csv}`."""

    planner: Annotated[Literal[1], BeforeValidator(first_format)] = Field(
        description="version of the spec's format: 1"
    )
    name: str = Field(min_length=1, max_length=200, description="what this campaign is for")
    requirement: Annotated[tuple[Requirement, ...], BeforeValidator(one_or_many)] = Field(
        min_length=1, description="what the navigation must achieve; one or more"
    )
    trajectory: Flight = Field(description="a name, {name: …, parameters}, or {file: flight.csv}")
    sensitivities: Source = Field("simulated", description="simulated, or {given: …} as published")
    unit: Unit = Field(description="the inertial unit and its error budgets")
    effects: tuple[str, ...] = Field(
        min_length=1,
        description="the declared error model; NAME_of_gyro, NAME_of_acc: an effect on that sensor only",
    )
    benches: dict[Name, Bench] = Field(min_length=1, description="name: bench")
    tests: dict[Name, Test] = Field(min_length=1, description="name: test")
    plan: PlanChoice = Field(default_factory=PlanChoice, description="how to plan")
    flown_after: Seconds = Field(
        60 * DAY_S, description="from the end of the campaign to the flight, e.g. 60 d, the default"
    )
    initial_alignment: InitialAlignment | None = Field(
        None, description="how well the flight knows its attitude at the start; default: perfectly"
    )
    vertical: Vertical | None = Field(
        None, description="what holds the computed height, {aided: 10 m}; default: nothing, it diverges"
    )
    recalibration: Recalibration | None = Field(
        None, description="what may be done in store between two calibrations, for `planner recalibrate`"
    )

    @property
    def planned_by(self) -> Literal["information", "published"]:
        """`plan.method`; published where a rule is worst_case or the sensitivities are given.

        By information a plan promises what will be flown: it takes requirements of probability, and a flight
        to see them on.
        """
        worst_case = any(r is None or r.rule == "worst_case" for r in self.requirement)  # a draft has gaps
        return "published" if worst_case or isinstance(self.sensitivities, Given) else self.plan.method

    @property
    def flown_after_days(self) -> float:
        """Days from the end of the campaign to the flight."""
        return self.flown_after / DAY_S
