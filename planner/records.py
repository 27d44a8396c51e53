"""The nouns between stages: frozen, SI and radians inside, temperatures in degrees Celsius.

A stage takes records and returns records; stages never call each other. Errors are named as `gyro.bias` is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.origin import Origin

Array = NDArray[np.float64]
Rule = Literal["worst_case", "rss", "percentile"]
Placement = Literal["even", "optimal", "joining", "fixed", "room"]


# ---------------------------------------------------------------- conditions and trajectories


@dataclass(frozen=True)
class Conditions:
    """What a sensor is exposed to, at n instants or in n records: the one question put to every effect.

    rate: (n, 3) true inertial angular rate in body axes, rad/s
    specific_force: (n, 3) true specific force in body axes, m/s^2
    temperature_degc: (n,); temperature_rate: (n,) K/s
    time_on: (n,) seconds since power-on; day: (n,) days since the calibration
    """

    rate: Array
    specific_force: Array
    temperature_degc: Array
    temperature_rate: Array
    time_on: Array
    day: Array


@dataclass(frozen=True)
class Trajectory:
    """A flight and the ideal readings that belong to it, on a uniform time grid of n + 1 instants.

    Body axes forward-right-down, navigation axes north-east-down, WGS-84.
    time_s: (n + 1,) uniform, from 0; latitude, longitude: (n + 1,) rad; altitude: (n + 1,) m
    velocity: (n + 1, 3) north, east, down relative to the Earth, m/s
    attitude: (n + 1, 3, 3) direction cosines C_nb, body to north-east-down
    angle_increment: (n, 3) integral of the ideal gyro readings over each interval, rad
    velocity_increment: (n, 3) integral of the ideal accelerometer readings over each interval, m/s
    temperature_degc: (n + 1,); time_on: (n + 1,) seconds since power-on; day: days since calibration
    """

    name: str
    time_s: Array
    latitude: Array
    longitude: Array
    altitude: Array
    velocity: Array
    attitude: Array
    angle_increment: Array
    velocity_increment: Array
    temperature_degc: Array
    time_on: Array
    day: float = 0.0


# ---------------------------------------------------------------- spec → sensitivities


@dataclass(frozen=True)
class SensitivityColumn:
    """Identity of one column of the linear combination.

    error: `gyro.bias`; axis: `x`, `y`, `z`, a term's name such as `xy`, or `all` for published coefficients
    unit: the display unit of the coefficient, `deg/s`, `g`, `1`, …
    """

    error: str
    axis: str
    unit: str


@dataclass(frozen=True)
class Sensitivities:
    """Navigation error per SI unit of every sensor error, error = computed − true.

    time_s: (m,) instants, the last one is the end of the flight
    position: (m, 3, p) north, east, up in metres per SI unit of column p
    velocity: (m, 3, p) north, east, up in m/s; attitude: (m, 3, p) roll, pitch, heading in rad
    """

    time_s: Array
    columns: tuple[SensitivityColumn, ...]
    position: Array
    velocity: Array
    attitude: Array


@dataclass(frozen=True)
class Constraint:
    """One requirement at one instant: how long the error vector may be, and what every error adds to it.

    requirement: index into the spec's requirements; time_s: the instant it holds at
    limit: SI; percentile: probability for rule `percentile`, else None
    vectors: error name -> (terms, k): components that the requirement asks for, per SI unit of each term
    """

    requirement: int
    error: str
    unit: str
    rule: Rule
    limit: float
    time_s: float
    vectors: Mapping[str, Array]
    percentile: float | None = None


# ---------------------------------------------------------------- sensitivities → allowances


@dataclass(frozen=True)
class ErrorModel:
    """What the spec says of one error `<sensor>.<effect>`, in SI.

    run_to_run: (temperature_degc, one sigma) pairs, one pair with NaN temperature when it is constant
    whole_variation: what remains without any temperature table (systematic size or largest residual)
    calibrated: whether the spec declares the effect and a test serves it; in_run_time: of in_run, s
    within: test -> sigma that the records of one repeat add to run_to_run; infinite where they cannot tell
    """

    name: str
    unit: str
    systematic: float
    run_to_run: tuple[tuple[float, float], ...]
    in_run: float
    storage: float
    whole_variation: float
    calibrated: bool
    within: Mapping[str, float] = field(default_factory=dict)
    in_run_time: float = 600.0

    @property
    def largest_run_to_run(self) -> float:
        """The run-to-run sigma at the temperature where it is worst: the flight may be there."""
        return max(sigma for _, sigma in self.run_to_run)


@dataclass(frozen=True)
class Allowance:
    """The allowed size of one error and its parts, in SI. worst_case: parts add; otherwise their squares.

    An error that nobody calibrates has its whole systematic size as its estimate's error.
    """

    error: str
    unit: str
    allowed: float
    run_to_run: float
    in_run: float
    storage: float
    temperature: float
    estimate: float
    calibrated: bool = True

    @property
    def parts(self) -> dict[str, float]:
        """The five parts by their names in plan.json."""
        return {
            "run_to_run": self.run_to_run,
            "in_run": self.in_run,
            "storage": self.storage,
            "temperature": self.temperature,
            "estimate": self.estimate,
        }


@dataclass(frozen=True)
class Corner:
    """The allowance vector in which one error is as large as it can be (or all are equally relaxed).

    genetic, exact: error name -> SI allowance; gap: (exact − genetic) / exact of the corner's own error
    """

    name: str
    genetic: Mapping[str, float]
    exact: Mapping[str, float]
    gap: float


@dataclass(frozen=True)
class GeneticHistory:
    """One run of the genetic algorithm: best and mean fitness per generation, for the convergence figure."""

    best: tuple[float, ...]
    mean: tuple[float, ...]
    generations: int
    evaluations: int
    stopped: Literal["converged", "generations"]


@dataclass(frozen=True)
class AllowedErrors:
    """Answer of the allowance stage: the region of sensor errors that the requirements leave.

    smallest, largest: error name -> SI bounds of the genes (best that the bench can reach; uncalibrated)
    front: allowance vectors on the limit that the genetic algorithm kept (Pareto set), in order of `errors`
    tightness: requirement index -> share of the limit used when every error is at its smallest
    """

    errors: tuple[str, ...]
    units: Mapping[str, str]
    smallest: Mapping[str, float]
    largest: Mapping[str, float]
    front: tuple[tuple[float, ...], ...]
    corners: tuple[Corner, ...]
    history: GeneticHistory
    tightness: Mapping[int, float]


# ---------------------------------------------------------------- allowances → repeats


@dataclass(frozen=True)
class TemperaturePoints:
    """One way to spread the calibration temperatures of an error, and the residual that it leaves.

    placement: `even`, `optimal` (dynamic programming on a measured curve), `joining` (rides along with the
    points of another error), `fixed` or `room`
    """

    temperatures_degc: tuple[float, ...]
    residual: float
    placement: Placement


@dataclass(frozen=True)
class PointMenu:
    """The temperature points that one error may choose in one test."""

    error: str
    test: str
    points: tuple[TemperaturePoints, ...]


@dataclass(frozen=True)
class RepeatLevels:
    """For one set of temperature points: repeats (L, T) that bring d to half_width (L,) at every point.

    Ordered from the fewest repeats to the most; half_width is the largest d over the points.
    """

    half_width: Array
    repeats: NDArray[np.int64]


@dataclass(frozen=True)
class ErrorMenu:
    """Everything one error may choose in one test: temperature points and, for each, the repeat levels."""

    error: str
    test: str
    points: tuple[TemperaturePoints, ...]
    levels: tuple[RepeatLevels, ...]


@dataclass(frozen=True)
class ErrorChoice:
    """What one error was given: its test, its points, and the half-width d that its repeats reach."""

    error: str
    test: str
    points: TemperaturePoints
    needed_repeats: tuple[int, ...]
    needed_half_width: float
    half_width: float


@dataclass(frozen=True)
class TestVisits:
    """The temperatures at which a test is made and the repeats at each; the union of what its errors need."""

    __test__ = False  # not a pytest class

    test: str
    temperatures_degc: tuple[float, ...]
    repeats: tuple[int, ...]


@dataclass(frozen=True)
class Campaign:
    """The chosen temperatures, repeats and allowances, with the proof that no choice costs less.

    objective: weighted cost in seconds of the work of one batch; bound: proved lower bound of it
    total_bound: that of the weighted total with waiting and batches; None: the work's own; by_total: whether
    another campaign takes less work, but longer with them; added: only to tell errors apart, not proved
    """

    visits: tuple[TestVisits, ...]
    choices: tuple[ErrorChoice, ...]
    objective: float
    bound: float
    proved: bool
    total_bound: float | None = None
    by_total: bool = False
    added: tuple[str, ...] = ()

    @property
    def gap(self) -> float:
        """(objective − bound) / objective."""
        return max(0.0, self.objective - self.bound) / self.objective if self.objective > 0 else 0.0


@dataclass(frozen=True)
class RepeatReason:
    """Why this number: the repeats of one error at one temperature, in SI; spread: sigma of one repeat."""

    error: str
    test: str
    temperature_degc: float
    spread: float
    confidence: float
    quantile_name: str
    quantile: float
    repeats: int
    half_width: float
    needed_half_width: float
    bound_by: Literal["accuracy", "least", "shared", "fixed"]


# ---------------------------------------------------------------- the plan


@dataclass(frozen=True)
class Step:
    """One action on one bench, with people if attended. Times in s from the start; motion in deg, deg/s."""

    id: str
    bench: str
    action: str
    start_s: float
    end_s: float
    test: str | None = None
    temperature_degc: float | None = None
    repeat: int | None = None
    motion: Mapping[str, float] | None = None
    units: int = 1
    attended: bool = False


@dataclass(frozen=True)
class PlannedChamber:
    """The chamber of a bench: its range, its speeds in K/s (None: at once), and how long a soak takes."""

    coldest_degc: float
    hottest_degc: float
    heating: float | None
    cooling: float | None
    soak_s: float


@dataclass(frozen=True)
class PlannedBench:
    """A bench as bench software must know it: axes, limits (SI, None: no limit), chamber, arm in metres.

    travel: axis -> its stops in rad; an axis that is not named turns on and on
    """

    name: str
    kind: str
    axes: int
    units: int
    room_degc: float
    rate: float | None
    angular_acceleration: float | None
    acceleration: float | None
    arm: float | None
    chamber: PlannedChamber | None
    travel: Mapping[int, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class PlannedTest:
    """What one test does: its temperatures and, for each, the repeats.

    attended: whether people make its power-ons and moves
    """

    test: str
    bench: str
    temperatures_degc: tuple[float, ...]
    repeats: tuple[int, ...]
    time_s: float
    power_on_s: float
    calibrates: tuple[str, ...] = ()
    motions: int = 1
    attended: bool = False


@dataclass(frozen=True)
class Achieved:
    """One requirement and what the plan reaches: `achieved` by the requirement's own rule, SI.

    flown: rms (rss) or promised percentile of flights by the campaign's own model; None: not predicted
    """

    error: str
    at: str
    rule: str
    unit: str
    limit: float
    achieved: float
    met: bool
    shares: Mapping[str, float]  # error name -> its part of `achieved` (worst_case) or of its square
    flown: float | None = None


@dataclass(frozen=True)
class GeneticPlan:
    """The genetic algorithm's campaign beside the exact one."""

    time_s: float
    gap: float
    history: GeneticHistory
    front: tuple[Mapping[str, float], ...]  # allowances in SI with key `time_s` among them


@dataclass(frozen=True)
class SensitivityFigure:
    """One coefficient as the plan used it: the length that one display unit of an error's term adds.

    value: in the requirement's unit per `per`, e.g. m per deg/s; unit: `m/(deg/s)`; requirement: its index
    """

    error: str
    axis: str
    value: float
    unit: str
    requirement: int


@dataclass(frozen=True)
class Saving:
    """Hours that one rule of the schedule saves: the same work timed with it and without it."""

    rule: str
    hours: float


@dataclass(frozen=True)
class TradeOffPoint:
    """The best campaign when a second of power-on is worth `power_on_weight` seconds of the campaign."""

    power_on_weight: float
    time_s: float
    power_on_s: float
    proved: bool


@dataclass(frozen=True)
class Plan:
    """The answer: a campaign, why it suffices, and the proof that none is shorter.

    objective: what was minimised, in words; objective_value, objective_bound: in weighted seconds
    bound_s: proved lower bound of the objective (of `time_s` when time alone is minimised); gap: relative
    hours_per_limit: requirement index -> hours saved per SI unit of more limit (continuous relaxation)
    start: when second 0 falls in the week of the shifts, `mon 08:00`; None without shifts
    by_total: chosen for a shorter `time_s`, at the price of more work; complete: not stopped at a time limit
    shifts: (opens, closes) in seconds from Monday 00:00, disjoint; none: always; plugins: of other packages
    work_proved: no temperatures and repeats take less work; `proved` is false when time_s exceeds its bound
    """

    version: str
    name: str
    spec_sha256: str
    seed: int
    objective: str
    requirements: tuple[Achieved, ...]
    sensitivities: tuple[SensitivityFigure, ...]
    allowances: tuple[Allowance, ...]
    tests: tuple[PlannedTest, ...]
    steps: tuple[Step, ...]
    reasons: tuple[RepeatReason, ...]
    time_s: float
    bound_s: float
    gap: float
    power_on_s: float
    objective_value: float
    hours_per_limit: Mapping[int, float]
    genetic: GeneticPlan | None
    notes: tuple[str, ...] = field(default=())
    objective_bound: float = 0.0
    proved: bool = True
    benches: tuple[PlannedBench, ...] = ()
    savings: tuple[Saving, ...] = ()
    trade_off: tuple[TradeOffPoint, ...] = ()
    work_proved: bool = False
    by_total: bool = False
    start: str | None = None
    shifts: tuple[tuple[float, float], ...] = ()
    plugins: tuple[Origin, ...] = ()
    complete: bool = True
