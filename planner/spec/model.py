"""The frozen typed spec. Every field's unit is in its type (`quantities`); SI and degrees Celsius inside.

What one field alone cannot tell (an effect's dimension, a temperature outside the chamber) is found by
`planner.spec.rules`, with the place in the file.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from planner.quantities import (
    Acceleration,
    Angle,
    AnyQuantity,
    Celsius,
    Count,
    KelvinPerSecond,
    Metres,
    PositiveAngularAcceleration,
    PositiveRate,
    PositiveSeconds,
    Rate,
    Seconds,
    Share,
)
from planner.units import Quantity

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


class SpecPart(BaseModel):
    """Base of every mapping in a spec: unknown keys are faults, nothing changes after loading."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False, arbitrary_types_allowed=True)


def _one_or_many(value: object) -> object:
    return value if isinstance(value, list | tuple) else [value]


class PercentileRule(SpecPart):
    """The exact percentile of the length of the Gaussian error vector."""

    percentile: Share


class Requirement(SpecPart):
    """What the navigation must achieve: `{error: position, limit: 10 m, rule: worst_case, at: end}`."""

    error: Literal[
        "position", "horizontal", "north", "east", "up", "velocity", "attitude", "roll_pitch", "heading"
    ]
    limit: AnyQuantity
    rule: Literal["worst_case", "rss"] | PercentileRule = "worst_case"
    at: Literal["end", "any"] | PositiveSeconds = "end"


class MeasuredCurve(SpecPart):
    """A measured error over temperature; the planner places the calibration points on it."""

    curve: dict[Celsius, AnyQuantity] = Field(min_length=2)


class ErrorBudget(SpecPart):
    """One sensor error: how large it is, and how it scatters.

    systematic: size before calibration; run_to_run: one sigma from power-on to power-on, or a table over
    temperature; in_run, storage: parts that no campaign removes; temperature_residual: what a
    piecewise-linear table of N points leaves, against N, or a measured curve over temperature
    """

    systematic: AnyQuantity | None = None
    run_to_run: AnyQuantity | dict[Celsius, AnyQuantity] | None = None
    in_run: AnyQuantity | None = None
    storage: AnyQuantity | None = None
    temperature_residual: MeasuredCurve | dict[Count, AnyQuantity] | None = None


class Unit(SpecPart):
    """The inertial unit: sensor -> effect name -> budget."""

    service_life: PositiveSeconds | None = None
    gyro: dict[str, ErrorBudget] = Field(default_factory=dict)
    accelerometer: dict[str, ErrorBudget] = Field(default_factory=dict)


class Chamber(SpecPart):
    """The thermal chamber of a bench. Without heating and cooling rates a change of temperature takes no time."""

    range: tuple[Celsius, Celsius]
    heating: KelvinPerSecond | None = None
    cooling: KelvinPerSecond | None = None
    soak: Seconds = 0.0


class BenchLimits(SpecPart):
    """What the bench can do at most; absent means not limited."""

    rate: PositiveRate | None = None
    angular_acceleration: PositiveAngularAcceleration | None = None
    acceleration: Acceleration | None = None


class Bench(SpecPart):
    """A bench: `kind` is a kind of bench by name (default: the bench's own name if that is a kind)."""

    kind: str | None = None
    axes: Annotated[Count, Field(le=6)] = 1
    units: Count = 1
    install: Seconds = 0.0
    remove: Seconds = 0.0
    move: Seconds = 0.0
    limits: BenchLimits = BenchLimits()
    chamber: Chamber | None = None
    arm: Metres | None = None


class Motion(SpecPart):
    """One motion: where an axis is held, how fast it turns, or the load of a centrifuge."""

    position_1: Angle | None = None
    position_2: Angle | None = None
    rate_1: Rate | None = None
    rate_2: Rate | None = None
    acceleration: Acceleration | None = None


class Test(SpecPart):
    """A test: which errors its records calibrate, and what one repeat costs.

    One repeat is one power-on: `power_on` until the first record may start, then for every motion a move of
    the bench, a record and a gap. `repeats` and `temperatures` fix what the planner would choose.
    """

    __test__ = False  # not a pytest class

    bench: str
    calibrates: Annotated[tuple[str, ...], BeforeValidator(_one_or_many)] = ()
    motions: Count | tuple[Motion, ...] = 1
    record: PositiveSeconds
    gap: Seconds = 0.0
    power_on: Seconds = 0.0
    temperatures: Literal["room"] | Count | tuple[Celsius, ...] | None = None
    repeats: Count | None = None

    @property
    def motion_count(self) -> int:
        """How many records one repeat makes."""
        return self.motions if isinstance(self.motions, int) else len(self.motions)


class TemperatureChoice(SpecPart):
    """Which numbers of temperature points the planner may choose, over which range."""

    range: tuple[Celsius, Celsius] = (-60.0, 60.0)
    candidates: tuple[Count, ...] = (1, 3, 5, 7, 10, 12, 15, 20)
    interpolate: bool = False
    room: Celsius = 20.0


class RepeatChoice(SpecPart):
    """How few and how many repeats the planner may choose per temperature."""

    least: Count = 2
    most: Count = 1000


class FixedTest(SpecPart):
    """A hand-made choice for one test: number or list of temperatures; repeats for all or one per temperature."""

    temperatures: Literal["room"] | Count | tuple[Celsius, ...] | None = None
    repeats: Count | tuple[Count, ...] | None = None


class Objective(SpecPart):
    """Weights of the two costs of a campaign: its duration and the power-on time of the unit."""

    time: Annotated[float, Field(ge=0)] = 1.0
    power_on: Annotated[float, Field(ge=0)] = 0.0


class Genetic(SpecPart):
    """Settings of the genetic algorithm; the defaults are K 3.4.3."""

    individuals: Annotated[Count, Field(ge=4, le=100_000)] = 256
    best: Annotated[Count, Field(ge=2)] = 32
    crossover: Annotated[float, Field(ge=0, le=1)] = 0.5
    mutation: Annotated[float, Field(ge=0, le=1)] = 0.01
    generations: Annotated[Count, Field(le=100_000)] = 500


class PlanChoice(SpecPart):
    """How to plan."""

    confidence: Share = 0.95
    quantile: Literal["student", "normal"] = "student"
    temperatures: TemperatureChoice = TemperatureChoice()
    repeats: RepeatChoice = RepeatChoice()
    minimise: Literal["time", "power_on"] | Objective = "time"
    fixed: dict[str, FixedTest] = Field(default_factory=dict)
    genetic: Genetic = Genetic()
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    time_limit: PositiveSeconds = 120.0


class Given(SpecPart):
    """Published coefficients instead of simulated ones: `{gyro.bias: 578.5 m/(deg/s)}`, all axes together."""

    given: dict[str, AnyQuantity]


class Spec(SpecPart):
    """A whole spec. `trajectory` is a name, or a mapping with `name` and parameters, or `{file: flight.csv}`."""

    planner: Literal[1]
    name: str = Field(min_length=1, max_length=200)
    requirement: Annotated[tuple[Requirement, ...], BeforeValidator(_one_or_many), Field(min_length=1)]
    trajectory: str | dict[str, Any]
    sensitivities: Literal["simulated"] | Given = "simulated"
    unit: Unit
    effects: tuple[str, ...]
    benches: dict[str, Bench] = Field(min_length=1)
    tests: dict[str, Test] = Field(min_length=1)
    plan: PlanChoice = PlanChoice()


def si(quantity: Quantity | None, otherwise: float = 0.0) -> float:
    """SI value of an optional quantity."""
    return otherwise if quantity is None else quantity.si
