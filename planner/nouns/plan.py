"""The plan: steps, benches, tests, what is achieved, and the proof."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from typing import Literal

from planner.nouns.allowances import Allowance, FlownCovariance, GeneticHistory
from planner.nouns.choices import RepeatReason, TestVisits
from planner.nouns.step import Step
from planner.origin import Origin

SCHEMA_VERSION = 1  # of plan.json; not in `plan_file`, whose forms take 50 ms to define


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

    family: of temperature curves, under which that is largest; temperature: where flights start, in words;
    both empty for a plan by the published method; spread_factor: `achieved` times it holds with the spec's
    confidence over spreads that are estimates
    """

    error: str
    at: str
    rule: str
    unit: str
    limit: float
    achieved: float
    met: bool
    shares: Mapping[str, float]  # error name -> its part of `achieved` (worst_case) or of its square
    family: str = ""
    temperature: str = ""
    spread_factor: float = 1.0


@dataclass(frozen=True)
class GeneticPlan:
    """The genetic algorithm's campaign beside the exact one.

    front: allowances in SI, or by information the figure of each requirement by its index, with `time_s` and
    `power_on_s`; campaigns: by information, what each point is made of
    """

    time_s: float
    gap: float
    history: GeneticHistory
    front: tuple[Mapping[str, float], ...]
    campaigns: tuple[tuple[TestVisits, ...], ...] = ()


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
class Worth:
    """What one visit buys. time_s, repeat_s: seconds saved without it, and with one repeat less

    without, one_fewer, one_more: the figures of every requirement (SI) without it, with one repeat less and
    with one more; infinite: something that flies is undetermined
    """

    test: str
    temperature_degc: float
    repeats: int
    time_s: float
    repeat_s: float
    without: tuple[float, ...]
    one_fewer: tuple[float, ...]
    one_more: tuple[float, ...]


@dataclass(frozen=True)
class Price:
    """What a change is worth: seconds of the campaign that it adds; negative: that it saves."""

    change: str
    time_s: float


@dataclass(frozen=True)
class Plan:
    """The answer: a campaign, why it suffices, and the proof that none is shorter.

    objective: what was minimised, in words; objective_value, objective_bound: in weighted seconds
    bound_s: proved lower bound of the objective (of `time_s` when time alone is minimised); gap: relative
    hours_per_limit: requirement index -> hours saved per SI unit of more limit (continuous relaxation)
    start: when second 0 falls in the week of the shifts, `mon 08:00`; None without shifts
    by_total: chosen for a shorter `time_s`, at the price of more work; complete: not stopped at a time limit
    shifts: (opens, closes) in seconds from Monday 00:00, disjoint; none: always; plugins: of other packages
    first_day: the date of second 0, where the spec says it; days_off: (day, what it is) without shifts
    shifts_period_s: after which the shifts come again: a week, or as long as days off are known
    work_proved: no temperatures and repeats take less work; `proved` is false when time_s exceeds its bound
    method: `information` promises what will be flown, `published` by half-widths and sums; families: of
    curves -> requirement index -> what is promised under it, SI; proved_of: among which campaigns it is the
    shortest
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
    first_day: date | None = None
    days_off: tuple[tuple[date, str], ...] = ()
    shifts_period_s: float = 604_800.0
    plugins: tuple[Origin, ...] = ()
    complete: bool = True
    method: Literal["information", "published"] = "published"
    temperature_estimator: Literal["lines", "smooth"] = "lines"
    families: Mapping[str, Mapping[int, float]] = field(default_factory=dict)
    proved_of: str = ""
    worth: tuple[Worth, ...] = ()
    prices: tuple[Price, ...] = ()
    covariance: FlownCovariance | None = None
