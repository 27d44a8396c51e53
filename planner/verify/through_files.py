"""A few units the whole way through files: dwell table, `planner calibrate`, `apply`, nonlinear flight.

The dwell table is written from verify's own draws. What the planner's own program makes of it, the exported
coefficients and the corrected flight, comes back as files, and the flight is navigated from the corrected
readings, sample by sample. The error must be that of the direct route, but for the estimators' difference.

Verify's estimator knows the variances and the temperatures that the table shows, so no linear unbiased one
is better, and the difference of another one from it has the variance by which that one is worse (Gauss,
Markov). `planner calibrate` finds the variances in the unit's data; with standard errors WORSE times the
least, the difference scatters by √(WORSE² − 1) of what the estimate itself does, on the shipped specs by 0.03
to 0.6 of it; SIGMAS are once in a million.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.physics.error_dynamics import ErrorHistory
from planner.physics.strapdown import integrate
from planner.protocols import SENSORS, Sensor
from planner.spec.model import NAVIGATION_ERRORS
from planner.units import from_si, unit_factor
from planner.verify.along_flight import apart, conditions_of, height_of, start_of
from planner.verify.calibrations import as_shown, readings
from planner.verify.draws import DrawnError, Exposed
from planner.verify.experiment import CHUNK, Experiment, Measured, left_by, units_measured
from planner.verify.findings import Fault
from planner.verify.flights import FlightModel, exact_coefficients, vectors_of
from planner.verify.references import directions
from planner.verify.residuals import Left
from planner.verify.smooth import prior_of
from planner.verify.strays import strays_of
from planner.verify.tally import Tally

SIGMAS = 5.0
WORSE = 1.05
SECOND_ORDER = 1e-3  # of the whole error: tables between their moments, effects kept to first order
CHECK = "through files"
SAID = "calibrate and verify's own estimator disagree"
_AT_ONCE = 10_000  # rows of a file
_AXES = "xyz"
_PER = {"gyro": ("dps", "deg/s"), "accelerometer": ("g", "g")}
_NAME = {"gyro": "gyro", "accelerometer": "acc"}


@dataclass(frozen=True)
class Pipeline:
    """The planner's own functions, which whoever calls verify hands in.

    calibrate: dwell table, folder -> the calibration's file; apply: calibration, readings, corrected file
    """

    calibrate: Callable[[Path, Path], Path]
    apply: Callable[[Path, Path, Path], None]


@dataclass(frozen=True)
class FilesCheck:
    """One requirement of one unit, SI: errors by both routes, how far apart, and how far they may be."""

    unit: int
    error: str
    through_files: float
    directly: float
    apart: float
    may: float


@dataclass(frozen=True)
class ThroughFiles:
    """What the units that went through files left; units: how many."""

    units: int = 0
    checks: tuple[FilesCheck, ...] = ()
    faults: tuple[Fault, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether both routes agree."""
        return not self.faults


def through_files(e: Experiment, tally: Tally, units: int, way: Pipeline, folder: Path) -> ThroughFiles:
    """The first `units` units of chunk 0, in files under `folder`; none where nothing is flown."""
    if e.flight is None or units == 0:
        return ThroughFiles(0)
    size = min(CHUNK, tally.flights)
    units = min(units, size)
    made = units_measured(e, 0, size)
    left = left_by(e, made, size)
    bare = e.flight.without_beside()
    span = e.spec.plan.temperatures.range
    off, strays = directions(e.records, e.spec), strays_of(e.records, e.chance, prior_of(e.spec))
    checks, faults = [], []
    for i in range(units):
        try:
            flown = _by_files(e, bare, made, left, i, size, way, folder / f"unit_{i + 1}")
        except InputError as error:
            faults.append(Fault(CHECK, f"unit {i + 1}", f"planner calibrate or apply refuses it: {error}"))
            continue
        records = replace(e.records, conditions=_shown(e, made, i))
        own = as_shown(e.estimators, records, e.unit, e.chance, off, strays, span)
        mine = left_by(replace(e, estimators=own), made, size)
        direct = bare.navigate(exact_coefficients(bare, mine)[i : i + 1])
        for r, wanted in enumerate(e.requirements):
            ours, theirs = (vectors_of(x, bare.instants, wanted)[:, :, 0] for x in (direct, flown))
            checks.append(_compared(i, wanted.error, ours, theirs, _scatter(e, tally, r)))
    return ThroughFiles(units, tuple(checks), (*faults, *_faults(checks)))


def _shown(e: Experiment, made: Measured, unit: int) -> Conditions:
    """Conditions of one unit's records as its table shows them."""
    n = len(e.records)
    rows = slice(unit * n, (unit + 1) * n)
    return made.met.shown.at(rows)


def _scatter(e: Experiment, tally: Tally, requirement: int) -> float:
    """Root mean square of the difference that the estimators may make to a requirement's error.

    Where the records leave a coefficient open each takes another one, as far apart as the estimate scatters.
    """
    estimate = float(np.sqrt(tally.squares[requirement, :, -1].sum() / tally.flights))
    is_open = any(x.undetermined.any() for several in e.estimators.values() for x in several)
    return estimate * (1.0 if is_open else float(np.sqrt(WORSE**2 - 1.0)))


def _compared(unit: int, error: str, own: Array, other: Array, scatter: float) -> FilesCheck:
    lengths = [float(np.linalg.norm(v, axis=1).max()) for v in (other, own, other - own)]
    may = SIGMAS * scatter + SECOND_ORDER * lengths[1]
    return FilesCheck(unit + 1, error, lengths[0], lengths[1], lengths[2], may)


def _faults(checks: Sequence[FilesCheck]) -> Iterable[Fault]:
    for c in checks:
        if not c.apart <= c.may:
            unit = NAVIGATION_ERRORS[c.error]
            far, may = (from_si(x, unit) for x in (c.apart, c.may))
            yield Fault(
                CHECK,
                f"unit {c.unit}, {c.error}",
                f"{SAID}: errors in flight are {far:.4g} {unit} apart, {may:.4g} {unit} may be",
            )


# ---------------------------------------------------------------- one unit


def _by_files(
    e: Experiment,
    flight: FlightModel,
    made: Measured,
    left: Sequence[Left],
    unit: int,
    size: int,
    way: Pipeline,
    folder: Path,
) -> ErrorHistory:
    folder.mkdir(parents=True, exist_ok=True)
    data, raw, corrected = (folder / name for name in ("dwells.csv", "flight.csv", "corrected.csv"))
    _write(data, _dwells(e, made, unit, size))
    calibration = way.calibrate(data, folder / "calibration")
    _write(raw, _flight_readings(flight, made.flight, left, unit))
    way.apply(calibration, raw, corrected)
    found = _read(corrected)
    return _navigated(flight, found["gyro"], found["accelerometer"])


def _dwells(e: Experiment, made: Measured, unit: int, size: int) -> dict[str, Sequence[object] | Array]:
    n, shown = len(e.records), _shown(e, made, unit)
    columns = _columns(shown, e.records.duration, e.records.run.tolist())
    for name, per, values in (
        ("ref_rate", "gyro", shown.rate),
        ("ref_acc", "accelerometer", shown.specific_force),
    ):
        columns |= _triad(name, per, values)
    for sensor in SENSORS:
        columns |= _triad(_NAME[sensor], sensor, made.readings[sensor].reshape(size, n, 3)[unit])
    return columns | {"step": e.records.step.tolist(), "bench": e.records.bench.tolist()}


def _flight_readings(
    flight: FlightModel, exposed: Exposed, left: Sequence[Left], unit: int
) -> dict[str, Sequence[object] | Array]:
    """What the unit reads in flight, sample by sample; its coefficients are linear between the moments."""
    trajectory = flight.trajectory
    n = len(trajectory.angle_increment)
    middle = (trajectory.time_s[:-1] + trajectory.time_s[1:]) / 2.0
    hat = np.array([np.interp(middle, flight.moments, row) for row in np.eye(len(flight.moments))])
    warmth = np.broadcast_to(exposed.temperature_degc, (len(left[0].true), len(hat)))[unit]
    c = replace(conditions_of(trajectory, 0, n), temperature_degc=warmth @ hat)
    none = np.zeros((0,))
    errors = [
        DrawnError(x.sensor, x.effect, x.terms, none, None, None, hat.T @ x.true[unit], none, none, none)
        for x in left
    ]
    columns = _columns(c, np.diff(trajectory.time_s), [1] * n)
    for sensor in SENSORS:
        columns |= _triad(_NAME[sensor], sensor, readings(sensor, c, errors, 0.0))
    return columns


def _navigated(flight: FlightModel, rate: Array, force: Array) -> ErrorHistory:
    """Errors (m, 3, 1) of the strapdown on corrected readings (n, 3) against the flight itself."""
    t = flight.trajectory
    step = float(t.time_s[1] - t.time_s[0])
    found, true = (
        integrate(
            start_of(t), angle, velocity, step, instants=flight.instants - t.time_s[0], height=height_of(t)
        )
        for angle, velocity in ((step * rate, step * force), (t.angle_increment, t.velocity_increment))
    )
    return ErrorHistory(flight.instants, *(x[:, :, None] for x in apart(found, true)))


# ---------------------------------------------------------------- files


def _columns(c: Conditions, duration: Array, run: Sequence[int]) -> dict[str, Sequence[object] | Array]:
    return {
        "unit": ["1"] * len(run),
        "run": run,
        "day": c.day,
        "time_on_s": c.time_on,
        "duration_s": duration,
        "temp_degc": c.temperature_degc,
        "temp_rate_degc_min": 60.0 * c.temperature_rate,
    }


def _triad(name: str, like: Sensor | str, values: Array) -> dict[str, Array]:
    suffix, unit = _PER[like]
    return {f"{name}_{axis}_{suffix}": values[:, i] / unit_factor(unit)[0] for i, axis in enumerate(_AXES)}


def _write(path: Path, columns: Mapping[str, Sequence[object] | Array]) -> None:
    """A dwell table as CSV, every number with all its digits; some rows at a time, for a flight has many."""
    rows = len(next(iter(columns.values())))
    with path.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(columns)
        for first in range(0, rows, _AT_ONCE):
            part = (values[first : first + _AT_ONCE] for values in columns.values())
            plain = (x.tolist() if isinstance(x, np.ndarray) else x for x in part)
            out.writerows(zip(*plain, strict=True))


def _read(path: Path) -> dict[Sensor, Array]:
    """(n, 3) readings of both sensors, SI. Raises InputError when a column is missing."""
    named = [(s, f"{_NAME[s]}_{axis}_{_PER[s][0]}") for s in SENSORS for axis in _AXES]
    with path.open(newline="") as file:
        lines = (line for line in file if not line.startswith("#"))
        header = next(csv.reader(lines), [])
        try:
            places = [header.index(name) for _, name in named]
            values = np.loadtxt(lines, delimiter=",", usecols=places, ndmin=2)
        except ValueError as error:
            raise InputError(f"{path}: the corrected flight cannot be read: {error}") from error
    return {
        sensor: values[:, 3 * i : 3 * i + 3] * unit_factor(_PER[sensor][1])[0]
        for i, sensor in enumerate(SENSORS)
    }
