"""What a plug-in must offer. One new effect, trajectory, bench or format is one file that satisfies one."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import SENSORS, Sensor
from planner.nouns.trajectory import Trajectory
from planner.quantities import DAY_S
from planner.units import UnitError, displayed, to_degc, to_si

__all__ = [
    "SENSORS",
    "BenchKind",
    "Condition",
    "Effect",
    "ExportFormat",
    "ExportOptions",
    "Exported",
    "Group",
    "Parameter",
    "RawBlock",
    "RawReader",
    "Sensor",
    "Term",
    "TrajectoryFamily",
]

Group = Literal["bias", "scale_factor", "misalignment"]
Condition = Literal["rate", "specific_force", "temperature_degc", "temperature_rate", "time_on", "day"]
AXES = "xyz"


@dataclass(frozen=True)
class Term:
    """One coefficient of an effect: `x`, `y`, `z` for a channel, `xy` for channel x driven by axis y.

    channels: indices of the channels that it acts on; left out, the one that its name begins with. Channels
        that have a term in common are fitted together.
    Raises ValueError when the name begins with no channel and none are given.
    """

    name: str
    channels: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if not self.channels:
            if self.name[:1] not in AXES or not self.name:
                raise ValueError(
                    f"term {self.name!r}: say on which channels it acts, e.g. channels=(0, 1, 2)"
                )
            object.__setattr__(self, "channels", (AXES.index(self.name[0]),))

    @property
    def shared(self) -> bool:
        """Whether several channels have this coefficient in common."""
        return len(self.channels) > 1


@dataclass(frozen=True)
class Parameter:
    """A parameter that does not enter linearly, such as a time constant.

    unit: `s`, `degC`, `day`, `1` …; default, low, high: in SI, temperatures in degC, days in days
    scale: `logarithmic` for what is positive and known to a factor, `linear` for what may have any sign
    stepped: the effect jumps where its variable passes the value, as at the day of a shock: there is no
        derivative, and records tell the value only as lying between two of theirs
    Raises ValueError for a range that does not hold the default, or reaches zero on a logarithmic scale.
    """

    name: str
    unit: str
    default: float
    low: float
    high: float
    scale: Literal["linear", "logarithmic"] = "logarithmic"
    stepped: bool = False

    def __post_init__(self) -> None:
        if not self.low <= self.default <= self.high or self.low == self.high:
            raise ValueError(
                f"parameter {self.name}: {self.low:g} … {self.high:g} must hold {self.default:g}"
            )
        if self.scale == "logarithmic" and self.low <= 0.0:
            raise ValueError(f"parameter {self.name}: a logarithmic scale must lie above zero")

    def carried(self, value: float) -> float:
        """The value as a fit carries it: its logarithm on a logarithmic scale."""
        return float(np.log(value)) if self.scale == "logarithmic" else value

    def value(self, carried: float) -> float:
        """The value of what a fit carries."""
        return float(np.exp(min(carried, 700.0))) if self.scale == "logarithmic" else carried

    def read(self, text: str) -> float:
        """The value of a text with a unit, `-30 degC`, `600 s`; a bare number is of days, or of unit 1.

        Raises UnitError when it is none, or lies outside the range.
        """
        value = self._read(text.strip())
        if not self.low <= value <= self.high:
            raise UnitError(f"{self.name} must lie in {self.shown(self.low)} … {self.shown(self.high)}")
        return value

    def _read(self, text: str) -> float:
        if self.unit == "degC":
            return to_degc(text)
        if self.unit != "day":
            return to_si(text, self.unit)
        bare = re.fullmatch(r"[-+.\deE]+", text) is not None
        return to_si(f"{text} day" if bare else text, "day") / DAY_S

    def displayed(self, value: float) -> float:
        """The number that stands before the unit."""
        return displayed(value, self.unit)

    def shown(self, value: float) -> str:
        """A value with its unit: `600 s`."""
        return f"{self.displayed(value):.6g} {self.unit}".removesuffix(" 1")

    @property
    def bounds(self) -> tuple[float, float]:
        """Low and high as a fit carries them."""
        return self.carried(self.low), self.carried(self.high)


@runtime_checkable
class Effect(Protocol):
    """An effect answers: what do you add to the sensor's output per unit of your coefficients?

    What else anybody must know of it, it says itself:
    name: one of the names of the interfaces, or a package's own; sensors: on which it exists
    units: sensor -> display unit of the coefficient, e.g. `deg/s/g`; coefficients are SI inside
    group: how the effect enters y_i = (1 + kappa_i)(M u)_i + b_i + noise: `bias`, `scale_factor`
        or `misalignment`
    parameters: those that do not enter linearly, any number of them
    needs: fields of Conditions that its regressors depend on; variable: the one that its curve runs along
    temperature_of: the effect whose change over temperature this one is; tabled: a calibration carries it in
        that effect's temperature table instead of by a coefficient of its own
    bench_only: the bench or its references do this, not the sensor: it does not fly, no reading is corrected
        for it, and no budget speaks of it; it changes u, whatever its group (`measurement.entering`)
    misfit: share of itself that its regressors cannot follow, because the records do not say all it needs
    largest: sensor -> the largest that a coefficient can be by nature, SI; None where nothing bounds it
    title, equation, source: for people
    """

    name: str
    sensors: tuple[Sensor, ...]
    units: Mapping[Sensor, str]
    group: Group
    parameters: tuple[Parameter, ...]
    needs: frozenset[Condition]
    variable: Condition | None
    temperature_of: str | None
    tabled: bool
    bench_only: bool
    misfit: float
    largest: Mapping[Sensor, float] | None
    title: str
    equation: str
    source: str

    @property
    def nonlinear(self) -> Mapping[str, float]:
        """Parameter -> its default."""
        ...

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """The effect's coefficients, in the order of the regressors' last axis."""
        ...

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(n, 3, n_terms) output in SI (rad/s or m/s^2) on x, y, z per SI unit of each coefficient.

        nonlinear: parameter -> value; those left out are at their defaults.
        """
        ...


@runtime_checkable
class TrajectoryFamily(Protocol):
    """A parametrised family of flights; `parameters` is a pydantic model of its settings (SI inside)."""

    name: str
    parameters: type[Any]

    def build(self, parameters: Any) -> Trajectory:
        """The flight with the ideal readings that belong to it."""
        ...


@runtime_checkable
class BenchKind(Protocol):
    """A kind of bench: what it can excite and how its motions are named.

    excites: which of `rate`, `gravity`, `acceleration`, `temperature` it can vary
    observes: errors, as `gyro.scale_factor`, that its records can show
    """

    name: str
    excites: frozenset[str]

    @property
    def observes(self) -> Set[str]:
        """Errors, as `gyro.scale_factor`, that its records can show."""
        ...

    def motions(
        self,
        count: int,
        axes: int,
        *,
        calibrates: Sequence[str] = (),
        rate_limit_dps: float = ...,
        load_limit_g: float = ...,
    ) -> tuple[Mapping[str, float], ...]:
        """`count` standard motions for what a test calibrates, within the bench's limits.

        Axis name -> deg (`position_1_deg`), deg/s (`rate_1_dps`) or g (`acceleration_g`).
        """
        ...


@dataclass(frozen=True)
class ExportOptions:
    """How to export; None takes the format's default.

    dialect: of a script; start: local time of the campaign's start, `2026-12-01T08:00`; timezone: IANA name
    """

    dialect: str | None = None
    start: str | None = None
    timezone: str | None = None


@dataclass(frozen=True)
class Exported:
    """What an export is: file name -> content, the main file first; and what a person should know of them."""

    files: Mapping[str, str | bytes]
    notes: tuple[str, ...] = ()


@runtime_checkable
class ExportFormat(Protocol):
    """A form in which a plan leaves. Works from the plan's tree (plan.json), which is what users have.

    suffix: of its first file, the one that `-o FILE` names; dialects: its default first
    """

    name: str
    suffix: str
    dialects: tuple[str, ...]

    def files(self, document: Mapping[str, Any], options: ExportOptions) -> Exported:
        """The plan in this form. Same plan and options, same bytes. Raises InputError when it cannot be."""
        ...


@dataclass(frozen=True)
class RawBlock:
    """Consecutive samples of a raw recording as they stand in the file.

    columns: name -> (n,); sample: (n,) number of each sample from 0, those that were lost counted where the
        format tells; losses: what this block lacks, reason -> number (`damaged_bytes`, `ragged_row`, …)
    remarks: sentences with the place of the first losses
    """

    columns: Mapping[str, NDArray[Any]]
    sample: NDArray[np.int64]
    losses: Mapping[str, int]
    remarks: tuple[str, ...] = ()


@runtime_checkable
class RawReader(Protocol):
    """A format of raw recordings. Reads in blocks, so that a file larger than memory goes through.

    suffixes: of its files, with the point
    """

    name: str
    suffixes: tuple[str, ...]

    def recognises(self, path: Path, head: bytes) -> bool:
        """Whether the file is of this format; head: its first kilobytes."""
        ...

    def names(self, path: Path, skip_lines: int = 0) -> tuple[str, ...]:
        """The columns of the file. Raises InputError when it cannot be read."""
        ...

    def blocks(
        self, path: Path, wanted: Sequence[str], texts: Sequence[str] = (), skip_lines: int = 0
    ) -> Iterator[RawBlock]:
        """The wanted columns, those in `texts` as text. Raises InputError when the file cannot be read."""
        ...
