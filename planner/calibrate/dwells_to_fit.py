"""Dwell table → calibration: the declared effects, or a named method, for every unit and sensor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from planner import __version__
from planner.calibrate.correction import true_input
from planner.calibrate.curve_contradiction import contradictions
from planner.calibrate.fit_options import DECLARED, SINS_OUTPUTS, FitOptions
from planner.calibrate.fit_to_calibration import sensor_calibration
from planner.calibrate.held_out import residual_of
from planner.calibrate.in_store import EFFECTS as RENEWED
from planner.calibrate.in_store import by_the_old, renewed
from planner.calibrate.methods import CUBES, METHODS, Method, resting
from planner.calibrate.reference_table import with_gravity
from planner.calibrate.rest_methods import (
    AGED,
    accelerometers_by_free_orientations,
    cube_references,
    modulus_check,
)
from planner.calibrate.rests_and_turns import by_rests_and_turns
from planner.calibrate.smooth_tables import smooth_tables
from planner.calibrate.what_would_tell import told_by_attitudes, told_by_turns
from planner.campaign.estimate import Estimate, Robust
from planner.campaign.model import campaign
from planner.campaign.noise import budget_of
from planner.campaign.power_ons import of_table
from planner.campaign.triad import ALL, TooFewRecords, shares
from planner.dwells.references import referenced
from planner.dwells.table_rows import by_run, rows_of, whole_turns, without_motions
from planner.errors import InputError, NothingFound
from planner.information.curves import Curves
from planner.nouns.array import Array
from planner.nouns.calibration import Calibration, SensorCalibration, SmoothTable, Tables
from planner.nouns.dwell_table import DwellTable
from planner.nouns.progress import Progress, silent
from planner.nouns.sensor import ErrorName
from planner.protocols import SENSORS, Sensor
from planner.spec.model import Spec


def calibrate(
    table: DwellTable,
    spec: Spec,
    options: FitOptions | None = None,
    *,
    spec_sha256: str = "",
    progress: Progress = silent,
) -> tuple[Calibration, ...]:
    """One calibration for every unit in the table.

    Raises InputError when the table has no readings, a sensor fewer rows than coefficients, or nothing that
    the method could take.
    """
    options = options or FitOptions()
    if len(table) == 0 or (table.gyro is None and table.acc is None):
        raise InputError(f"{table.source or 'the table'} has no readings: nothing to calibrate")
    curves = Curves(spec)  # what is drawn of them serves all units
    return tuple(
        _calibrate_unit(rows_of(table, table.unit == unit), curves, options, spec_sha256, progress)
        for unit in np.unique(table.unit)
    )


def _calibrate_unit(
    table: DwellTable, curves: Curves, options: FitOptions, sha256: str, progress: Progress
) -> Calibration:
    progress(f"fitting the sensors of {table.unit[0]}")
    if options.method in CUBES:
        table = whole_turns(table)
    elif options.method != "rests_and_turns":
        table = without_motions(table)
    if options.prior is not None:
        sensors, notes = _renewed(table, curves, options, options.prior)
    elif options.method == "rests_and_turns":
        sensors, notes = by_rests_and_turns(table), []
        notes += told_by_turns(sensors[0])
    elif options.method in (DECLARED, SINS_OUTPUTS):
        sensors, notes = _by_declared_effects(table, curves, options)
    elif options.method in METHODS:
        sensors, notes = _by_method(table, curves, options, METHODS[options.method])
    elif options.method == "ellipsoid":
        sensors, notes = [accelerometers_by_free_orientations(table, by="ellipsoid")], []
        notes.append("the ellipsoid calibrates the accelerometers alone")
    else:
        form = "symmetric" if options.method.endswith("symmetric") else "triangular"
        sensors, notes = [accelerometers_by_free_orientations(table, form)], []  # type: ignore[arg-type]  # one of the two words that it takes
        notes.append("free orientations calibrate the accelerometers alone")
        notes += [] if table.acc is None else told_by_attitudes(table.acc, sensors[0])
    return Calibration(
        unit=str(table.unit[0]),
        version=__version__,
        source=table.source,
        spec_name=curves.spec.name,
        spec_sha256=sha256,
        sensors=tuple(sensors),
        notes=(*table.notes, *notes),
    )


# ---------------------------------------------------------------- the general estimator


def _by_declared_effects(
    table: DwellTable, curves: Curves, options: FitOptions
) -> tuple[list[SensorCalibration], list[str]]:
    """The spec's effects; without a reference the accelerometers by |f| = g, which then is the gyros' one."""
    notes: list[str] = []
    found: list[SensorCalibration] = []
    if table.ref_acc is None and table.acc is not None:
        table, free = with_gravity(table)
        notes.append("no ref_acc: the accelerometers are calibrated by |f| = g and are the reference then")
        found.append(free)
    table, assumed = referenced(table, options.latitude)
    wanted: tuple[Sensor, ...] = ("gyro",) if found else SENSORS
    fitted, missing = _fitted(table, wanted, curves, curves.spec.effects, options)
    return [*fitted, *found], [*notes, *assumed, *missing]


def _renewed(
    table: DwellTable, curves: Curves, options: FitOptions, prior: Mapping[Sensor, Tables]
) -> tuple[list[SensorCalibration], list[str]]:
    """Bias and scale factor anew on top of the old calibration; without references as a cube."""
    notes: list[str] = []
    table = by_the_old(table, prior)
    if table.ref_acc is None and table.acc is not None:
        table, notes = cube_references(table, options.turn, AGED)
    table, assumed = referenced(table, options.latitude)
    found, missing = _fitted(table, SENSORS, curves, RENEWED, options)
    return [renewed(change, prior[change.sensor]) for change in found], [*notes, *assumed, *missing]


def _by_method(
    table: DwellTable, curves: Curves, options: FitOptions, method: Method
) -> tuple[list[SensorCalibration], list[str]]:
    notes: list[str] = []
    if options.method in CUBES:
        table, notes = cube_references(table, options.turn, _scale_off(curves))
    table, assumed = referenced(table, options.latitude)
    keep = method.rows(table)
    if not keep.any():
        raise NothingFound(
            f"--method {options.method} ({method.source}) needs {method.needs}; the table has none"
        )
    table = rows_of(table, keep)
    if options.method in CUBES:
        found, missing = _cube(table, curves, method, options)
    else:
        found, missing = _fitted(table, method.sensors, curves, method.effects, options)
    if options.method == "triad_least_squares" and table.acc is not None and found:
        f = true_input(table.acc, found[-1].tables, "accelerometer", table.conditions())
        notes.append(modulus_check(table.acc, f))
    return found, [*notes, *assumed, *missing]


def _scale_off(curves: Curves) -> float:
    """By how much of itself the gyros' scale factor may be off before calibration; 0: the spec is silent."""
    budget = budget_of(curves.spec.unit, ErrorName("gyro.scale_factor"))
    return 0.0 if budget is None else budget.systematic_size


def _cube(
    table: DwellTable, curves: Curves, method: Method, options: FitOptions
) -> tuple[list[SensorCalibration], list[str]]:
    """Gyros from rests and turns; accelerometers from rests alone (B): a turn adds its centripetal part."""
    gyros, one = _fitted(table, [s for s in method.sensors if s == "gyro"], curves, method.effects, options)
    if "accelerometer" not in method.sensors:
        return gyros, one
    still = rows_of(table, resting(table))
    if len(still) == 0:
        raise InputError("--method cube: no row is a rest on a face, which the accelerometers are made from")
    accelerometers, other = _fitted(still, ("accelerometer",), curves, method.effects, options)
    return [*gyros, *accelerometers], [*one, *other]


def _fitted(
    table: DwellTable,
    sensors: Sequence[Sensor],
    curves: Curves,
    effects: tuple[str, ...],
    options: FitOptions,
) -> tuple[list[SensorCalibration], list[str]]:
    ordered, _ = by_run(table)
    found, notes, spec = [], [], curves.spec
    for sensor in sensors:
        readings = readings_of(ordered, sensor)
        if readings is None:
            notes.append(f"no {sensor} columns: the {sensor}s are not calibrated")
            continue
        if (ordered.ref_rate if sensor == "gyro" else ordered.ref_acc) is None:
            notes.append(f"no reference for the {sensor}s: they are not calibrated")
            continue
        fits = fit_sensor(ordered, sensor, spec, options.robust, effects)
        residuals = [residual_of(fit, readings[:, fit.model.channel]) for fit in fits]
        smooth: tuple[SmoothTable, ...] = ()
        if spec.plan.temperature_estimator == "smooth":
            smooth = smooth_tables(fits, curves, options.nodes)
        remarks = contradictions(fits, curves)
        found.append(sensor_calibration(sensor, fits, residuals, spec, options.method, smooth, remarks))
    return found, notes


def readings_of(table: DwellTable, sensor: Sensor) -> Array | None:
    """(n, 3) what the sensor's channels read."""
    return table.gyro if sensor == "gyro" else table.acc


def fit_sensor(
    table: DwellTable,
    sensor: Sensor,
    spec: Spec,
    robust: Robust = "no",
    effects: tuple[str, ...] | None = None,
    channels: Sequence[int] = ALL,
) -> list[Estimate]:
    """The channels of a sensor; the table's rows stand run by run.

    effects: the error model; the spec's by default; channels: which are asked for, all three where they have
        a coefficient in common. Raises InputError for too few rows and for a channel that is dead.
    """
    readings = readings_of(table, sensor)
    where = table.source or "the table"
    if readings is None:
        raise InputError(f"no {sensor} columns in {where}")
    names = spec.effects if effects is None else effects
    asked = ALL if shares(sensor, names) else channels
    _check_alive(readings, asked, sensor, where)
    try:
        slopes = cache(lambda: Curves(spec).slopes(table.temperature_degc))
        return campaign(spec, of_table(table), names, slopes).estimate(sensor, readings, robust, asked)
    except TooFewRecords as error:
        raise InputError(f"{where}: {error}; measure more records, or declare fewer effects") from error


def _check_alive(readings: Array, channels: Sequence[int], sensor: Sensor, where: str) -> None:
    """Refuse a channel whose records are all the same to the last digit: no noise, so no sensor."""
    from planner.units import from_si

    unit = "deg/s" if sensor == "gyro" else "g"
    for channel in channels:
        values = readings[:, channel]
        if len(values) >= 3 and np.ptp(values) == 0.0:
            raise InputError(
                f"{where}: {sensor} {'xyz'[channel]} reads {from_si(float(values[0]), unit):.6g} {unit} in "
                f"all {len(values)} records: a dead, saturated or padded channel; mend it, or leave the "
                f"{sensor}'s columns out"
            )
