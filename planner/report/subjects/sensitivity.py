"""The linear-combination coefficients, and the allowed sensor errors that follow from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from planner.nouns.allowances import AllowedErrors
from planner.report.blocks import Cell, Report, Section, Table, Text, existing, section, table
from planner.report.charts import flight_time
from planner.report.charts import plan as charts
from planner.report.numbers import NOTHING, digits, display_unit, percent
from planner.report.readable import sensitivities_in
from planner.report.subjects import plan_tables
from planner.units import unit_factor

if TYPE_CHECKING:
    from planner.plan.flights_side_by_side import FlightBeside, FlownErrors
    from planner.plan.spec_to_sensitivity import SensitivityRow

_UNCALIBRATED = (
    "The unit as nobody has calibrated it: each error at its systematic size plus its random parts, all with "
    "the worst sign (worst case). By axis: gyro and accelerometer of an axis together."
)


def sensitivity_report(
    rows: Sequence[SensitivityRow],
    flown: FlownErrors | None = None,
    name: str = "",
    units: Mapping[str, str] | None = None,
) -> Report:
    """The position error per unit of every column; errors over the flight; flights side by side.

    units: error -> the spec's own unit of it
    """
    told = plan_tables.rows_table(rows, units or {})
    if flown is None:
        return Report(
            "Sensitivities", name, "", sections=existing(section("sensitivities", "Sensitivities", told))
        )
    found = sensitivities_in(flown.found, units or {})
    per_unit = charts.sensitivity_picture(found, list(dict.fromkeys(c.error for c in found.columns)))
    columns = section("sensitivities", "Sensitivities", per_unit, told)
    beside = _beside(flown, units or {})
    return Report("Sensitivities", name, "", sections=existing(columns, _over_flight(flown), beside))


def _over_flight(flown: FlownErrors) -> Section | None:
    pictures = [
        flight_time.over_flight_picture(c, f"over-flight-{i}", _UNCALIBRATED)
        for i, c in enumerate(flown.curves)
    ]
    return section("over-flight", "The error over the time of flight", *pictures, only="page")


def _beside(flown: FlownErrors, units: Mapping[str, str]) -> Section | None:
    """What every error costs on several flights, as K table 3.1 has it."""
    picture = flight_time.flights_picture(
        flown.totals, "Position error of the unit as nobody has calibrated it, worst case, on each flight."
    )
    return section("flights", "Several flights", picture, flights_table(flown.flights, units))


def flights_table(flights: Sequence[FlightBeside], units: Mapping[str, str]) -> Table | None:
    """Position error per display unit of each error, all axes together; its ratio to the first flight's."""
    if not flights:
        return None
    columns = ["error", "per"]
    for i, f in enumerate(flights):
        columns += [f"{f.name}, m"] if i == 0 else [f"{f.name}, m", "ratio"]
    rows: list[list[Cell]] = []
    for error, unit in flights[0].unit.items():
        shown = display_unit(units.get(error, unit))
        row: list[Cell] = [error, shown]
        for i, f in enumerate(flights):
            row.append(digits(f.per_unit[error] * unit_factor(shown)[0]))
            if i > 0:
                row.append(digits(f.ratio[error], 3) if f.ratio[error] == f.ratio[error] else NOTHING)
        rows.append(row)
    when = f"after {flights[0].time_s:g} s of flight"
    return table(f"Position error {when}, lengths of all axes added", " | ".join(columns), rows)


def allowed_report(allowed: AllowedErrors) -> Report:
    """The corners of the allowed errors, genetic beside exact, and what the bench's best would use."""
    history = allowed.history
    tightness = [
        Text(f"requirement {i + 1}: the smallest errors that the bench can reach use {percent(share)}")
        for i, share in allowed.tightness.items()
    ]
    found = Text(
        f"genetic algorithm: {len(allowed.front)} Pareto points, {history.generations} generations, "
        f"{history.evaluations} evaluations ({history.stopped})"
    )
    bounds, corners = plan_tables.bounds_table(allowed), plan_tables.corners_table(allowed, compact=True)
    parts = section("allowed", "Allowed sensor errors", *tightness, bounds, corners, found)
    return Report("Allowed sensor errors", "", "", sections=existing(parts))
