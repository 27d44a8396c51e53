"""A calibration: before and after per channel, the coefficients, what is not determined."""

from __future__ import annotations

import math

from planner.nouns.calibration import Calibration, Coefficient, SensorCalibration, SmoothTable
from planner.report.blocks import Report, Table, Text, existing, section, table
from planner.units import displayed, from_si

UNITS = {"gyro": "deg/s", "accelerometer": "g"}


def calibration_report(calibration: Calibration) -> Report:
    """What is left of the residual, and every coefficient with its interval."""
    sensors = calibration.sensors
    parts = (
        section(
            s.sensor,
            s.sensor,
            _residuals(calibration.unit, s),
            _coefficients(s),
            _smooth(s),
            *(Text(f"note: {note}") for note in s.notes),
        )
        for s in sensors
    )
    return Report("Calibration", calibration.unit, "", sections=existing(*parts))


def _residuals(unit: str, sensor: SensorCalibration) -> Table | None:
    shown = UNITS[sensor.sensor]
    return table(
        f"{unit}, {sensor.sensor}: residual RMS in {shown}",
        "channel | before | after | rows | held-out runs",
        (
            (
                r.channel,
                *(f"{from_si(x, shown):.4g}" for x in (r.before, r.after)),
                str(r.rows),
                str(r.runs) if r.held_out else "none: fitted rows",
            )
            for r in sensor.residuals
        ),
    )


def _coefficients(sensor: SensorCalibration) -> Table | None:
    return table(
        f"{sensor.sensor}: coefficients, {sensor.method}",
        "error | term | degC | value | ± 95 % | unit |",
        map(_row, sensor.coefficients),
    )


def _smooth(sensor: SensorCalibration) -> Table | None:
    return table(
        f"{sensor.sensor}: smooth tables",
        "error | term | nodes | degC | ± 95 % | unit | curves beside the spec's table",
        map(_smooth_row, sensor.smooth),
    )


def _smooth_row(s: SmoothTable) -> tuple[str, ...]:
    halves = [displayed(float(x), s.unit) for x in (s.high - s.low) / 2.0]
    size, low, high = (f"{x:.2g}" for x in s.size)
    t = s.temperature_degc
    return (
        s.error,
        s.term,
        str(len(t)),
        f"{t[0]:g} to {t[-1]:g}",
        f"{min(halves):.2g} to {max(halves):.2g}",
        s.unit,
        f"{size} times ({low} to {high})",
    )


def _row(c: Coefficient) -> tuple[str, ...]:
    at = "" if c.temperature_degc is None else f"{c.temperature_degc:.1f}"
    if c.status == "undetermined":
        return c.error, c.term, at, "—", "—", c.unit, c.status
    half = displayed((c.high - c.low) / 2.0, c.unit)
    said = f"{half:.2g}" if math.isfinite(half) else "—"
    status = "" if c.status == "determined" else c.status
    return c.error, c.term, at, f"{displayed(c.value, c.unit):.6g}", said, c.unit, status
