"""The flows that close the loop: data → diagnosis with before and after; spec and diagnosis → new spec."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from planner import __version__
from planner.diagnose.diagnosis_to_navigation import navigation_costs
from planner.diagnose.diagnosis_to_next_measurement import next_measurements
from planner.diagnose.diagnosis_to_residual import UnitFits, residual_changes, unit_fits
from planner.diagnose.diagnosis_to_spec import SpecUpdate, updated_spec
from planner.diagnose.dwells_to_diagnosis import diagnose as diagnose_unit
from planner.diagnose.evidence_veto import (
    held_to_the_floor,
    limits_that_stand,
    refused_by_flight,
    refused_by_residual,
    told,
)
from planner.diagnose.records.gravity_of_turns import gravity_of_turns
from planner.dwells.dwell_checks import check_rests
from planner.dwells.dwell_files import read_dwells
from planner.dwells.table_rows import rows_of
from planner.errors import InfeasibleError, InputError
from planner.nouns.diagnosis import Diagnosis, FoundEffect, NavigationCost, ResidualChange, UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.nouns.plan import Plan
from planner.nouns.progress import Progress
from planner.pipelines.budgets import with_cost
from planner.plan.spec_to_trajectory import flight_path
from planner.solvers.one_thread import one_thread
from planner.spec.load import LoadedSpec, spec_from_bytes
from planner.spec.model import Given
from planner.units import unit_factor


@dataclass(frozen=True)
class Diagnosed:
    """One unit's diagnosis with the table that its evidence belongs to, row for row."""

    diagnosis: Diagnosis
    table: DwellTable


@one_thread()
def diagnose(
    data: Path,
    loaded: LoadedSpec,
    seed: int,
    progress: Progress,
    plan: Mapping[str, Any] | None = None,
) -> tuple[Diagnosed, ...]:
    """Dwell table's file and spec → the diagnosis of every unit in it, in the order of their names.

    plan: the tree of a plan.json, whose promises make the flight's total
    """
    progress(f"reading {data}")
    table = read_dwells(data)
    digest = _sha256(data)
    units = np.unique(table.unit)
    if len(units) == 0:
        raise InputError(f"{data} has no rows: nothing to diagnose")
    promised = _promised(plan)
    every = [
        _diagnosed(rows_of(table, table.unit == u), loaded, seed, digest, progress, promised) for u in units
    ]
    return tuple(
        replace(one, diagnosis=with_cost(one.diagnosis, loaded, plan, promised, progress)) for one in every
    )


def _promised(plan: Mapping[str, Any] | None) -> tuple[float, ...]:
    """What a plan promises of each requirement, SI."""
    if plan is None:
        return ()
    return tuple(float(r["achieved"]) * unit_factor(r["unit"])[0] for r in plan["requirements"])


def _diagnosed(
    table: DwellTable,
    loaded: LoadedSpec,
    seed: int,
    digest: str,
    progress: Progress,
    promised: Sequence[float],
) -> Diagnosed:
    check_rests(table)
    found = diagnose_unit(table, loaded.spec, seed=seed, progress=progress)
    gravity = gravity_of_turns(table)
    table = table if gravity is None else gravity.table  # evidence is of what was judged
    progress(f"{found.unit}: before and after on runs held out")
    found, fits, residual = _confirmed(table, loaded, found)
    progress(f"{found.unit}: what it costs in flight")
    navigation, notes = _navigation(found, fits, loaded)
    if any(not c.helps for c in navigation):
        one = partial(_alone, found, fits, loaded)
        found, fell = refused_by_flight(found, one)
        if fell:
            found, fits, residual = _confirmed(table, loaded, found)
            navigation, notes = _navigation(found, fits, loaded)
    if len(promised) == len(navigation):
        navigation = tuple(replace(c, promised=p) for c, p in zip(navigation, promised, strict=True))
    if loaded.absent:
        notes.append(
            f"the spec is of the sensor alone (no {', '.join(loaded.absent)}): no metres, no next record"
        )
    progress(f"{found.unit}: what to measure next")
    return Diagnosed(
        Diagnosis(
            found=limits_that_stand(found),
            residual=residual,
            navigation=navigation,
            next_measurement=() if loaded.absent else next_measurements(found.effects, fits, loaded.spec),
            version=__version__,
            spec_name=loaded.spec.name,
            spec_sha256=loaded.sha256,
            data_sha256=digest,
            source=table.source,
            seed=seed,
            notes=(*table.notes, *notes),
        ),
        table,
    )


def _confirmed(
    table: DwellTable, loaded: LoadedSpec, found: UnitDiagnosis
) -> tuple[UnitDiagnosis, UnitFits, tuple[ResidualChange, ...]]:
    """The diagnosis that its own evidence on unseen power-ons lets stand, with that evidence."""
    fits = unit_fits(table, loaded.spec, found)
    residual = residual_changes(fits)
    found, fell = refused_by_residual(found, residual)
    if fell:
        fits = unit_fits(table, loaded.spec, found)
        residual = residual_changes(fits)
    return held_to_the_floor(found, residual), fits, residual


def _navigation(
    found: UnitDiagnosis, fits: UnitFits, loaded: LoadedSpec
) -> tuple[tuple[NavigationCost, ...], list[str]]:
    if not found.fitted or loaded.absent:
        return (), []
    try:
        trajectory = flight_path(loaded.spec, loaded.folder)
    except InputError as error:
        if not isinstance(loaded.spec.sensitivities, Given):
            raise
        return (), [f"no navigation error: the spec gives published coefficients and no flight ({error})"]
    return navigation_costs(found.fitted, fits, loaded.spec, trajectory), []


def _alone(
    found: UnitDiagnosis, fits: UnitFits, loaded: LoadedSpec, effect: FoundEffect
) -> tuple[NavigationCost, ...]:
    """What one effect costs by itself, of its coefficients those that are told from zero.

    One that is sure has siblings that are not: they are no reason to doubt its name, though flown together
    they are worse than nothing.
    """
    return _navigation(replace(found, effects=(told(effect),), unknown=()), fits, loaded)[0]


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


# ---------------------------------------------------------------- update


@dataclass(frozen=True)
class Replanned:
    """The plans of the old spec and of the new one; None and why where there is none."""

    old: Plan | None
    new: Plan | None
    why: tuple[str, ...]


def update(loaded: LoadedSpec, diagnosis: Diagnosis, target: Path) -> tuple[SpecUpdate, LoadedSpec]:
    """Spec and a diagnosis of it → the text of the new spec, checked as `planner check` would."""
    made = updated_spec(loaded.text, loaded, diagnosis)
    return made, spec_from_bytes(made.text.encode(), target)


def replanned(old: LoadedSpec, new: LoadedSpec, progress: Progress) -> Replanned:
    """Plan both specs: hours and metres before and after, no genetic campaign, which nothing here shows."""
    from planner.pipelines import planning  # a quarter of a second that a diagnosis does not need

    why: list[str] = []
    plans: list[Plan | None] = []
    for loaded, name in ((old, "the old spec"), (new, "the new spec")):
        try:
            progress(f"planning {name}")
            plans.append(planning.exact_plan(loaded, progress))
        except InfeasibleError as error:
            why.append(f"{name} cannot be planned: {error}")
            plans.append(None)
    return Replanned(plans[0], plans[1], tuple(why))
