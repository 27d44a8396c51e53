"""The budget of a sensor error: its size before calibration, how it scatters, what temperature does to it.

Every number may be written in a short form (a quantity) or in a longer one; the accessors of `ErrorBudget`
say the same of all forms, in SI, so that nobody else has to know the forms.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, GetJsonSchemaHandler, Tag, model_validator
from pydantic_core import CoreSchema

from planner.nouns.array import Array
from planner.quantities import (
    AnyQuantity,
    Celsius,
    NumberOfPowerOns,
    PositiveKelvin,
    PositiveSeconds,
)
from planner.spec.forms import (
    INPUT_PATTERN,
    mapping_or_text,
    of_forms,
    or_else,
    text_table_or_parts,
)
from planner.spec.part import SpecPart
from planner.spec.temperature_residual import (
    CurveName,
    MeasuredCurve,
    MeasuredCurves,
    Residual,
    ResidualTable,
)
from planner.units import Quantity

IN_RUN_TIME_S = 600.0  # correlation time of the in-run process where the spec gives none
STORAGE_DAYS = 60.0  # a budget's storage is what two months do (K 2.5.3)
INPUT_REACH = 1.0 / 100.0  # of the range: below it no sane number of repeats tells a scale factor (K 2.5.2)


class InRun(SpecPart):
    """What moves within one power-on: a first-order Gauss-Markov process, E g g' = value² exp(−|Δt|/time)."""

    value: AnyQuantity = Field(description="one sigma, e.g. 0.001 deg/s")
    correlation_time: PositiveSeconds = Field(IN_RUN_TIME_S, description="default 600 s")


_InRun = Annotated[
    Annotated[AnyQuantity, or_else("{value: 1 deg/h, correlation_time: 600 s}"), Tag("text")]
    | Annotated[InRun, Tag("mapping")],
    of_forms(
        "must be a number with unit such as 1 deg/h, or {value: 1 deg/h, correlation_time: 600 s}",
        mapping_or_text,
    ),
]


class OverInput(SpecPart):
    """One sigma over the input: rates of a gyro, loads of an accelerometer (K table 2.17).

    table: input -> sigma. Kept beyond its ends. K finds a scale factor out of reach below 1/100 of the range:
    `largest` is that of the inputs above, and what stands where one figure speaks for all inputs.
    """

    table: dict[AnyQuantity, AnyQuantity] = Field(min_length=2)

    @model_validator(mode="before")
    @classmethod
    def _from_one_mapping(cls, written: Any) -> Any:
        """In the file the inputs are the keys."""
        return {"table": written} if isinstance(written, dict) and "table" not in written else written

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """As it stands in the file."""
        schema = handler.resolve_ref_schema(handler(core))
        table = schema["properties"].pop("table")
        schema.pop("required", None)
        return {**schema, **table, "propertyNames": {"pattern": INPUT_PATTERN}}

    @property
    def points(self) -> tuple[tuple[float, float], ...]:
        """(input, sigma) in SI, ascending in the input."""
        return tuple(sorted((at.si, sigma.si) for at, sigma in self.table.items()))

    @property
    def largest(self) -> float:
        """Sigma (SI) at the input above 1/100 of the last one where it is largest."""
        reach = INPUT_REACH * self.points[-1][0]
        return max(sigma for at, sigma in self.points if at >= reach)


Spread = Annotated[
    Annotated[AnyQuantity, or_else("a table {-55 degC: 2 mg, 20 degC: 1 mg}"), Tag("text")]
    | Annotated[dict[Celsius, AnyQuantity], Field(min_length=1), Tag("table")]
    | Annotated[OverInput, Tag("inputs")],
    of_forms(
        "must be a number with unit such as 1 mg, a table {-55 degC: 2 mg, 20 degC: 1 mg}, or one over the "
        "input, {10 deg/s: 0.11 %, 500 deg/s: 0.12 %}",
        text_table_or_parts(),
    ),
]


class RunToRun(SpecPart):
    """One power-on's draw over temperature, r(T) = s(T) z(T), z Gaussian of unit variance.

    E z(T) z(T') = exp(−(T − T')² / (2 L²)), L the `temperature_correlation`; left out: one z everywhere
    power_ons n: s was estimated from so many, s² (n − 1) / χ²(n − 1) is what it may be; left out: it is known
    """

    value: Spread = Field(description="one sigma, e.g. 1 mg, or {-55 degC: 2 mg, 20 degC: 1 mg}")
    temperature_correlation: PositiveKelvin | None = Field(
        None, description="over which distance one power-on's draw stays the same, e.g. 40 K"
    )
    power_ons: NumberOfPowerOns | None = Field(
        None,
        description="from so many power-ons the spread was estimated, e.g. 12; left out: it is known exactly",
    )


_RunToRun = Annotated[
    Annotated[
        AnyQuantity,
        or_else("a table {-55 degC: 2 mg, 20 degC: 1 mg}, or {value: 1 mg, power_ons: 12}"),
        Tag("text"),
    ]
    | Annotated[dict[Celsius, AnyQuantity], Field(min_length=1), Tag("table")]
    | Annotated[OverInput, Tag("inputs")]
    | Annotated[RunToRun, Tag("parts")],
    of_forms(
        "must be a number with unit such as 1 mg, a table {-55 degC: 2 mg, 20 degC: 1 mg}, one over the "
        "input {10 deg/s: 0.11 %, 500 deg/s: 0.12 %}, "
        "or {value: 1 mg, power_ons: 12, temperature_correlation: 40 K}",
        text_table_or_parts("value", "temperature_correlation", "power_ons"),
    ),
]


class ErrorBudget(SpecPart):
    """One sensor error: how large it is, and how it scatters.

    systematic: size before calibration; run_to_run: one sigma from power-on to power-on, over temperature if
    it varies; in_run, storage: parts that no campaign removes; temperature_residual: what a piecewise-linear
    table of N points leaves, against N, or the curve over temperature measured on one unit or on several
    """

    systematic: AnyQuantity | None = Field(
        None, description="largest size before calibration, e.g. 0.03 deg/s"
    )
    run_to_run: _RunToRun | None = Field(
        None,
        description="one sigma from power-on to power-on, e.g. 0.002 deg/s, or {-55 degC: 0.012 deg/s, …}; "
        "of a scale factor also over the input, {10 deg/s: 0.11 %, 500 deg/s: 0.12 %}; "
        "{value: any of these, power_ons: 12} where that spread is an estimate, "
        "temperature_correlation: 40 K beside it for a draw that changes with temperature",
    )
    in_run: _InRun | None = Field(
        None,
        description="what moves within one power-on, e.g. 0.001 deg/s, "
        "or {value: 0.001 deg/s, correlation_time: 600 s}",
    )
    storage: AnyQuantity | None = Field(
        None, description="what moves in store until the flight, e.g. 0.001 deg/s"
    )
    temperature_residual: Residual | None = Field(
        None,
        description="what is left against the number of points, {1: 0.032 deg/s, 5: 0.0035 deg/s}, "
        "figure: largest or sigma and the curves' family, curve: kink, beside them; "
        "or {curve: {-60 degC: 0.03 deg/s, …}}, the error over temperature measured on one unit; "
        "or {curve: [{…}, {…}, {…}]}, on several",
    )

    @property
    def systematic_size(self) -> float:
        """Largest size before calibration, SI; 0 where the spec has none."""
        return _si(self.systematic)

    # ------------------------------------------------------------ from power-on to power-on

    @property
    def has_run_to_run(self) -> bool:
        """Whether the spec says how it scatters from power-on to power-on."""
        return self.run_to_run is not None

    @property
    def _spread(self) -> Quantity | Mapping[float, Quantity] | OverInput | None:
        return self.run_to_run.value if isinstance(self.run_to_run, RunToRun) else self.run_to_run

    @property
    def run_to_run_table(self) -> Mapping[float, float] | None:
        """Temperature (degC, ascending) -> sigma (SI); None where one sigma holds everywhere."""
        spread = self._spread
        return {t: spread[t].si for t in sorted(spread)} if isinstance(spread, Mapping) else None

    def run_to_run_sigma(self, temperature_degc: Array) -> Array:
        """Sigma (SI) at temperatures (...), linear between the table's nodes; 0 where the spec has none."""
        table = self.run_to_run_table
        if table is None:
            return np.full(np.shape(temperature_degc), self.run_to_run_largest)
        return np.asarray(np.interp(temperature_degc, [*table], [*table.values()]))

    @property
    def run_to_run_largest(self) -> float:
        """Sigma (SI) at the temperature, or the input, where it is largest: the flight may be there."""
        spread = self._spread
        if isinstance(spread, OverInput):
            return spread.largest
        return max(q.si for q in spread.values()) if isinstance(spread, Mapping) else _si(spread)

    @property
    def run_to_run_over_input(self) -> tuple[tuple[float, float], ...]:
        """(input, sigma) in SI, ascending; () where the spread is the same at all inputs."""
        return self._spread.points if isinstance(self._spread, OverInput) else ()

    @property
    def temperature_correlation(self) -> float | None:
        """L in K of exp(−(T − T')² / (2 L²)); None: one power-on's draw is the same at every temperature."""
        return self.run_to_run.temperature_correlation if isinstance(self.run_to_run, RunToRun) else None

    @property
    def power_ons(self) -> int | None:
        """From how many power-ons the spread was estimated; None: it is known."""
        return self.run_to_run.power_ons if isinstance(self.run_to_run, RunToRun) else None

    # ------------------------------------------------------------ within a power-on, and over days

    @property
    def in_run_sigma(self) -> float:
        """Sigma (SI) of the process within a power-on; 0 where the spec has none."""
        return _si(self.in_run.value if isinstance(self.in_run, InRun) else self.in_run)

    @property
    def in_run_time(self) -> float:
        """Correlation time (s) of the process within a power-on."""
        return self.in_run.correlation_time if isinstance(self.in_run, InRun) else IN_RUN_TIME_S

    @property
    def storage_sigma(self) -> float:
        """Sigma (SI) of what STORAGE_DAYS in store do; 0 where the spec has none."""
        return _si(self.storage)

    # ------------------------------------------------------------ over temperature

    @property
    def measured_curve(self) -> MeasuredCurve | None:
        """The error over temperature measured on one unit, if the spec has one."""
        residual = self.temperature_residual
        return residual if isinstance(residual, MeasuredCurve) else None

    @property
    def measured_curves(self) -> tuple[MeasuredCurve, ...]:
        """The curves of each of several units; () where the spec has none, or one unit's."""
        residual = self.temperature_residual
        return residual.units if isinstance(residual, MeasuredCurves) else ()

    @property
    def curve_family_name(self) -> CurveName | None:
        """The family of curves that the spec names beside the table; None where it leaves that open."""
        residual = self.temperature_residual
        return residual.curve if isinstance(residual, ResidualTable) else None

    @property
    def residual_table(self) -> Mapping[int, float] | None:
        """Number of points (ascending) -> what they leave (SI); None without one or with a measured curve."""
        residual = self.temperature_residual
        if not isinstance(residual, ResidualTable):
            return None
        return {n: residual.table[n].si for n in sorted(residual.table)}

    @property
    def residual_figure(self) -> Literal["largest", "sigma"]:
        """What the numbers of `residual_table` are."""
        residual = self.temperature_residual
        return residual.figure if isinstance(residual, ResidualTable) else "largest"

    @property
    def whole_variation(self) -> float:
        """What remains without any temperature table, SI: the systematic size or the largest residual."""
        return max(self.systematic_size, self.curve_size)

    @property
    def curve_size(self) -> float:
        """The largest residual over temperature, SI; 0 where the spec has none."""
        measured = [m for m in (self.measured_curve, *self.measured_curves) if m is not None]
        found = [float(np.abs(m.values).max()) for m in measured]
        return max([0.0, *found, *(self.residual_table or {}).values()])


def _si(quantity: Quantity | None) -> float:
    """SI value of an optional quantity."""
    return 0.0 if quantity is None else quantity.si
