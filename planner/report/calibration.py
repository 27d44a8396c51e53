"""A calibration on the terminal: before and after per channel, the coefficients, what cannot be told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from planner.calibration import Calibration, Coefficient, SensorCalibration
from planner.units import displayed, from_si

if TYPE_CHECKING:
    from rich.console import Console

_UNITS = {"gyro": "deg/s", "accelerometer": "g"}


def print_calibration(calibrations: Sequence[Calibration], console: Console) -> None:
    """Print every unit's calibration."""
    for calibration in calibrations:
        for sensor in calibration.sensors:
            _print_residuals(calibration.unit, sensor, console)
            _print_coefficients(sensor, console)
            for note in sensor.notes:
                console.print(f"note: {note}", markup=False)


def _print_residuals(unit: str, sensor: SensorCalibration, console: Console) -> None:
    from rich.table import Table

    shown = _UNITS[sensor.sensor]
    table = Table(title=f"{unit}, {sensor.sensor}: residual RMS in {shown}", title_justify="left")
    for name in ("channel", "before", "after", "rows", "held-out runs"):
        table.add_column(name, justify="left" if name == "channel" else "right")
    for r in sensor.residuals:
        runs = str(r.runs) if r.held_out else "none: fitted rows"
        figures = (f"{from_si(x, shown):.4g}" for x in (r.before, r.after))
        table.add_row(r.channel, *figures, str(r.rows), runs)
    console.print(table)


def _print_coefficients(sensor: SensorCalibration, console: Console) -> None:
    from rich.table import Table

    table = Table(title=f"{sensor.sensor}: coefficients, {sensor.method}", title_justify="left")
    for name in ("error", "term", "degC", "value", "± 95 %", "unit", ""):
        table.add_column(name, justify="right" if name in ("degC", "value", "± 95 %") else "left")
    for c in sensor.coefficients:
        table.add_row(*_row(c))
    console.print(table)


def _row(c: Coefficient) -> tuple[str, ...]:
    at = "" if c.temperature_degc is None else f"{c.temperature_degc:.1f}"
    if c.status == "undetermined":
        return c.error, c.term, at, "—", "—", c.unit, c.status
    half = displayed((c.high - c.low) / 2.0, c.unit)
    value = f"{displayed(c.value, c.unit):.6g}"
    return (
        c.error,
        c.term,
        at,
        value,
        f"{half:.2g}" if math.isfinite(half) else "—",
        c.unit,
        "" if c.status == "determined" else c.status,
    )
