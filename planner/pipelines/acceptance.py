"""Checks and calibrations → units accepted, rejected or undecided; spec → the cheapest checks that decide."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner.dwells.dwell_files import read_dwells
from planner.errors import InputError
from planner.fleet.acceptance import UnitAcceptance, accepted
from planner.fleet.basis import Basis
from planner.fleet.calibration_documents import (
    CalibratedUnit,
    calibration_residuals,
    is_calibration,
    read_calibration,
)
from planner.fleet.check_groups import by_temperature
from planner.fleet.check_plan import Check, planned_checks
from planner.fleet.check_residual import MeasuredResidual, check_residuals
from planner.fleet.judge import ErrorRates
from planner.fleet.looks import accepted_as_they_come
from planner.nouns.dwell_table import DwellTable
from planner.nouns.progress import Progress
from planner.pipelines.fleet import basis_of
from planner.solvers.one_thread import one_thread
from planner.spec.load import LoadedSpec


@dataclass(frozen=True)
class Accepted:
    """The units of a batch."""

    basis: Basis
    units: tuple[UnitAcceptance, ...]
    rates: ErrorRates
    sources: tuple[str, ...]
    notes: tuple[str, ...] = ()


@one_thread()
def accept(
    inputs: Sequence[Path],
    loaded: LoadedSpec,
    plan: Mapping[str, Any] | None,
    rates: ErrorRates,
    progress: Progress,
    *,
    as_residual: bool = False,
    looks: int | None = None,
) -> Accepted:
    """Dwell tables of checks, and calibrations → every unit accepted, rejected or undecided.

    looks: so many power-ons were planned, and the check may stop after each. Raises InputError for looks at
    calibrations, or at several tables: power-ons must come one after another.
    """
    read = _read(inputs, progress)  # a file that is none is told before the minutes that a plan takes
    table = None if looks is None else _only_table(read)
    basis = basis_of(loaded, plan, progress)
    reach = loaded.spec.plan.temperatures.range
    notes: Sequence[str]
    if table is not None and looks is not None:
        progress("looking after every power-on")
        units = accepted_as_they_come(table, basis.models, basis.region, reach, rates, looks)
        notes = table.notes
    else:
        found, notes = _residuals(read, basis, as_residual)
        progress("judging")
        units = accepted(found, basis.region, reach, rates)
    return Accepted(basis, units, rates, tuple(map(str, inputs)), (*basis.notes, *notes))


def _only_table(read: Sequence[CalibratedUnit | DwellTable]) -> DwellTable:
    if len(read) == 1 and isinstance(read[0], DwellTable):
        return read[0]
    raise InputError("--looks judges the power-ons of one dwell table as they come; give one table alone")


def _read(inputs: Sequence[Path], progress: Progress) -> list[CalibratedUnit | DwellTable]:
    """Calibrations and dwell tables, in the order given."""
    found = list[CalibratedUnit | DwellTable]()
    for path in inputs:
        progress(f"reading {path}")
        found.append(read_calibration(path) if is_calibration(path) else read_dwells(path))
    return found


@dataclass(frozen=True)
class PlannedChecks:
    """Checks that decide a unit, the cheapest first."""

    basis: Basis
    checks: tuple[Check, ...]


@one_thread()
def plan_check(
    loaded: LoadedSpec,
    plan: Mapping[str, Any] | None,
    load: float,
    share: float,
    rates: ErrorRates,
    progress: Progress,
) -> PlannedChecks:
    """The cheapest records that decide such a share of the units at a load of the limit."""
    basis = basis_of(loaded, plan, progress)
    progress("temperatures, faces and power-ons that decide a unit")
    spec = loaded.spec
    return PlannedChecks(basis, planned_checks(spec, basis.models, basis.region, load, share, rates))


def _residuals(
    read: Sequence[CalibratedUnit | DwellTable], basis: Basis, as_residual: bool
) -> tuple[list[MeasuredResidual], list[str]]:
    found: list[MeasuredResidual] = []
    calibrations: dict[str, list[CalibratedUnit]] = {}
    notes: list[str] = []
    seen: set[str] = set()
    for table in read:
        if isinstance(table, CalibratedUnit):
            calibrations.setdefault(table.unit, []).append(table)
            continue
        measured = check_residuals(table, by_temperature(table), basis.models, basis.region)
        again = seen & {m.unit for m in measured}
        if again:
            notes.append(f"{', '.join(sorted(again))} stands in several files: taken as one unit")
        seen |= {m.unit for m in measured}
        notes += table.notes
        found += measured
    for unit, units in calibrations.items():
        if unit in seen:
            notes.append(f"{unit}: its check was judged, not its calibration")
            continue
        found += calibration_residuals(units, basis.region, as_residual=as_residual)
    if calibrations and not as_residual:
        notes.append(_how_calibrations(calibrations))
    return found, notes


def _how_calibrations(calibrations: Mapping[str, Sequence[CalibratedUnit]]) -> str:
    if any(len(c) > 1 for c in calibrations.values()):
        return "several calibrations of a unit: the first corrects, the last minus the first is the residual"
    return "a calibration alone: its coefficients are corrected, what their intervals leave was judged"
