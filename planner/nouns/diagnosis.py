"""The nouns of a diagnosis: what the declared error model lacks, on what evidence, and what it costs.

SI and radians inside; `unit` is the display unit. Channels are `gyro_x` … `accelerometer_z`; the file writes
`acc_x` for the latter (interfaces, section 6).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.diagnosed_spreads import Assumption, BudgetExceeded, CampaignCost
from planner.nouns.sensor import Sensor
from planner.units import unit_factor

Split = Literal["runs", "branches", "blocks", "none"]
LEAST_P = 0.001  # what a thousand sign flips can tell; a family-wise p below is extrapolated
Verdict = Literal["clean", "explained", "partly_explained", "unexplained", "untestable"]


@dataclass(frozen=True)
class FoundTerm:
    """One coefficient of a found effect, SI, with 95 % interval.

    parameter: one of the effect's parameters, as the effect takes it: SI, temperatures in degC, days in days
    """

    name: str
    channel: str
    value: float
    low: float
    high: float
    freedom: float
    unit: str
    parameter: bool = False

    @property
    def scale(self) -> float:
        """SI per display unit; temperatures and days of parameters stand as they are."""
        return 1.0 if self.parameter and self.unit in ("degC", "day", "d") else unit_factor(self.unit)[0]


@dataclass(frozen=True)
class Rival:
    """An effect that the data cannot tell from the one found; or a variable, along which nobody has a name.

    separated_by: square root of the noncentrality by which the data prefer the found one, in sigma
    """

    effect: str
    separated_by: float


@dataclass(frozen=True)
class FoundEffect:
    """An effect that the declared model lacks.

    p_value: family-wise; strength: whitened length of its contribution, √Δ; nonlinear: its parameters
    chance_by_fit: family-wise p of its coefficients in the calibration's fit; 0 where that says nothing
    """

    effect: str
    sensor: Sensor
    channels: tuple[str, ...]
    terms: tuple[FoundTerm, ...]
    p_value: float
    strength: float
    rivals: tuple[Rival, ...] = ()
    below_bench_uncertainty: bool = False
    nonlinear: Mapping[str, float] = field(default_factory=dict)
    chance_by_fit: float = 0.0


@dataclass(frozen=True)
class Unknown:
    """Something is missing that no effect of the library explains. varies_with: `temperature`, `time_on` …

    curve: what was measured of it over that variable, an effect without a name of its own; None without one
    """

    channels: tuple[str, ...]
    varies_with: str
    p_value: float
    strength: float
    curve: FoundEffect | None = None


LITTLE = 0.1  # of the square of an effect's sigma: rows that see less hardly speak of it
EXPECTED = 0.01  # chance at which a reference error is no more than the accuracy that is stated of it


@dataclass(frozen=True)
class ReferenceSuspect:
    """A reference of the bench, or a label of its records, that explains the residual better than a sensor.

    value, low, high: in `unit`; channels: that it shows on; check: what to look at
    separated_by: from what a sensor error could do of it, in sigma; 0 where no data of this bench can tell
    record: the record that would tell it from the sensor's error `alias`, where it is one
    stated: what the spec's `accuracy` says of each coefficient, one sigma, in `unit`; 0: nothing
    chance: that a bench as accurate as stated is off by so much; 1 where nothing is stated
    """

    hypothesis: str
    value: float
    low: float
    high: float
    unit: str
    channels: tuple[str, ...]
    p_value: float
    strength: float
    check: str
    separated_by: float
    alias: str = ""
    record: str = ""
    stated: float = 0.0
    chance: float = 1.0

    @property
    def expected(self) -> bool:
        """Whether the bench is off by no more than its stated accuracy: no fault, and nothing to mend."""
        return self.stated > 0.0 and self.chance >= EXPECTED


@dataclass(frozen=True)
class RowLeftOut:
    """A record that no model of the unit can follow. guess: what may have happened; size: in sigma."""

    run: int
    step: str
    channel: str
    size: float
    guess: str
    condition: str = ""


@dataclass(frozen=True)
class NotFound:
    """An effect that was looked for in vain: no larger than this with 95 % confidence, SI.

    nonlinear: the parameters at which that holds, the nearest to their defaults that the data tell at all
    terms: those of which it holds, where the data tell some and not others; empty: of all
    """

    effect: str
    sensor: Sensor
    upper_limit: float
    unit: str
    nonlinear: Mapping[str, float] = field(default_factory=dict)
    terms: tuple[str, ...] = ()


@dataclass(frozen=True)
class Untestable:
    """An effect that the data cannot show, and why (which column or condition is missing)."""

    effect: str
    sensor: Sensor | None
    why: str


@dataclass(frozen=True)
class ResidualChange:
    """Residual root mean square of one channel on runs that the fit had not seen, SI, before and after.

    *_low, *_high: 95 % interval; within: about the mean of each run
    noise_floor: from replicates in different runs; noise_floor_within: the same about the mean of each run
    sigma_*: within runs, in units of what the noise model expects of each row: 1 is noise alone
    white: noise of a record at rest; stray: share of the input that adds to it; record: mean duration, s
    how: how it was held out, in words; held_out: False when nothing could be; split: what was held out
    foreseen: sigma that what was found is to move these rows by within runs; inf: not known
    falls: of the sum of squares within runs, each row in units of its own noise; NaN: not known
    weighed_*: in units of the noise model, what records of a run have in common among it: 1 is noise alone
    """

    channel: str
    unit: str
    before: float
    before_low: float
    before_high: float
    after: float
    after_low: float
    after_high: float
    within_before: float
    within_after: float
    noise_floor: float
    rows: int
    runs: int
    held_out: bool
    how: str
    noise_floor_within: float = float("nan")
    sigma_before: float = float("nan")
    sigma_after: float = float("nan")
    white: float = float("nan")
    stray: float = float("nan")
    record: float = float("nan")
    split: Split = "runs"
    foreseen: float = float("inf")
    falls: float = float("nan")
    weighed_before: float = float("nan")
    weighed_after: float = float("nan")

    @property
    def weighed_falls(self) -> bool:
        """Whether these rows are foreseen better, each by as much as its noise lets it tell.

        Both within runs and with the levels that runs draw, as the noise model has them.
        """
        return self.falls > 0.0 and self.weighed_after < self.weighed_before

    def sees_little(self, strength: float) -> bool:
        """Whether these rows are to be moved by little of an effect of so many sigma by all rows."""
        return self.foreseen**2 < LITTLE * strength**2

    @property
    def rises_by_the_loudest(self) -> bool:
        """Whether the plain figure does not fall though, weighed by the noise of each record, it does."""
        return self.weighed_falls and self.after >= self.before


@dataclass(frozen=True)
class Evidence:
    """What the report draws, for one channel of one unit, SI.

    rows: (n,) rows of the table that these are, in its order; None: every one of them
    before, after: (n,) residual under the declared model and with what was found added
    added: effect -> (n, 2) added-variable plot: what the effect adds and the reading, both cleared of the
        declared model (n rows, whitened scale removed)
    expected: (n,) standard deviation that the noise model expects of a row
    shared: (k, n) of that what a row has in common with all of its power-on, one sigma each, with its sign
    """

    channel: str
    before: Array
    after: Array
    expected: Array
    added: Mapping[str, Array]
    shared: Array
    rows: NDArray[np.int64] | None = None


@dataclass(frozen=True)
class NavigationCost:
    """What the undeclared effects cost on the spec's trajectory, SI: nobody compensates, and compensated.

    as_calibrated: nobody compensates, but the declared coefficients took up what they could on the bench
    promised: what the plan promises without it, NaN where no plan is given
    """

    error: str
    unit: str
    before: float
    after: float
    confidence: float
    how: str
    as_calibrated: float = float("nan")
    limit: float = float("nan")
    promised: float = float("nan")

    @property
    def total_before(self) -> float:
        """What a flight of the plan comes to if nobody compensates: a fixed error beside what is promised."""
        known = [x for x in (self.before, self.as_calibrated) if math.isfinite(x)]
        return self.promised + max(known, default=math.nan)

    @property
    def total_after(self) -> float:
        """The same once it is compensated: what the intervals leave is independent of what is promised."""
        return math.hypot(self.promised, self.after)

    @property
    def left_alone(self) -> float:
        """What a flight has of it if nobody does anything, in the way that costs more; NaN where unknown."""
        return max((x for x in (self.before, self.as_calibrated) if math.isfinite(x)), default=math.nan)

    @property
    def helps(self) -> bool:
        """Whether compensation leaves less than nobody's doing anything."""
        return (
            not math.isfinite(self.left_alone)
            or not math.isfinite(self.after)
            or (self.after <= self.left_alone)
        )


@dataclass(frozen=True)
class NextMeasurement:
    """A bench step that would separate two rivals.

    condition: what to do, names with units (`temperature_degc`, `rate_1_dps`, `repeats` …); separation: sigma
        reached with it; time_s: what it costs
    """

    separates: tuple[str, str]
    bench: str
    test: str
    condition: Mapping[str, float | str]
    separation: float
    time_s: float


@dataclass(frozen=True)
class Refused:
    """An effect that the search took up and its own evidence refuses, and why."""

    effect: str
    channels: tuple[str, ...]
    why: str


@dataclass(frozen=True)
class UnitDiagnosis:
    """What the data of one unit say, before anything is made of it.

    refused: what was tried and did not enter; kept: (n,) rows of the table that were judged, None for all
    """

    unit: str
    verdict: Verdict
    effects: tuple[FoundEffect, ...]
    unknown: tuple[Unknown, ...]
    not_found: tuple[NotFound, ...]
    untestable: tuple[Untestable, ...]
    evidence: tuple[Evidence, ...]
    assumptions: tuple[Assumption, ...]
    notes: tuple[str, ...] = ()
    reference_suspects: tuple[ReferenceSuspect, ...] = ()
    rows_left_out: tuple[RowLeftOut, ...] = ()
    budget_exceeded: tuple[BudgetExceeded, ...] = ()
    refused: tuple[Refused, ...] = ()
    kept: NDArray[np.bool_] | None = None

    @property
    def faults(self) -> tuple[ReferenceSuspect, ...]:
        """The references that are off by more than the spec states of them, or of which it states nothing."""
        return tuple(s for s in self.reference_suspects if not s.expected)

    @property
    def fitted(self) -> tuple[FoundEffect, ...]:
        """What is fitted beside the declared model: effects that have a name, and curves that have none."""
        return (*self.effects, *(u.curve for u in self.unknown if u.curve is not None))


@dataclass(frozen=True)
class Diagnosis:
    """The whole answer: what was found, before and after, what it costs, what to measure next.

    campaign: what exceeded budgets cost on the bench, where a plan was given
    """

    found: UnitDiagnosis
    residual: tuple[ResidualChange, ...]
    navigation: tuple[NavigationCost, ...]
    next_measurement: tuple[NextMeasurement, ...]
    version: str
    spec_name: str
    spec_sha256: str
    data_sha256: str
    source: str
    seed: int
    notes: tuple[str, ...] = ()
    campaign: CampaignCost | None = None
