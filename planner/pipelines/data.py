"""The flows of measured data, each one short list of stage calls: simulate, calibrate, apply."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner.calibrate.dwells_to_fit import calibrate as calibrate_table
from planner.calibrate.fit_options import SINS_OUTPUTS, FitOptions
from planner.calibrate.lines_in_flight import lines_in_flight
from planner.calibrate.nothing_found import refuse_nothing
from planner.campaign.design import Design, design
from planner.errors import unusable_file
from planner.export.reduction import noise_of_account
from planner.nouns.calibration import Calibration, RandomCharacteristic
from planner.nouns.dwell_table import DwellTable
from planner.nouns.given_files import SETTINGS
from planner.nouns.plan_file import steps_of
from planner.nouns.progress import Progress
from planner.nouns.trajectory import Trajectory
from planner.plan.default_campaign import default_campaign
from planner.plan.schedule_to_steps import steps as steps_of_campaign
from planner.plan.spec_to_trajectory import trajectory_of
from planner.simulate.campaign import Settings, Truth, prepared
from planner.simulate.campaign import simulate as simulate_unit
from planner.simulate.families import family_named
from planner.simulate.hidden import hidden_effect
from planner.solvers.one_thread import one_thread
from planner.spec.load import LoadedSpec
from planner.spec.model import Spec


def simulate(
    loaded: LoadedSpec,
    plan: Mapping[str, object] | None,
    hidden: Sequence[str],
    seed: int,
    settings: Settings | None = None,
    latitude_deg: float = 45.0,
    curves: str = "measured",
) -> tuple[DwellTable, Truth]:
    """Spec, and a plan's tree if there is one → the dwell table that the bench would have measured.

    curves: the family of the temperature curves. Raises InputError for one that there is not.
    """
    effects = [hidden_effect(text) for text in hidden]
    bench = bench_design(loaded.spec, plan, latitude_deg)
    unit = prepared(loaded.spec, family_named(curves))
    return simulate_unit(bench, unit, seed, hidden=effects, settings=settings)


def bench_design(spec: Spec, plan: Mapping[str, object] | None, latitude_deg: float) -> Design:
    """What the bench does by a plan's tree; without one, the spec's tests by default."""
    steps = steps_of_campaign(spec, default_campaign(spec)) if plan is None else steps_of(plan)
    return design(steps, spec, float(np.radians(latitude_deg)))


def simulation_settings(path: Path) -> dict[str, object]:
    """The keys and values of a YAML file of settings. Raises InputError when it cannot be read."""
    from planner.spec.yaml12 import read_yaml

    try:
        data = path.read_bytes()
    except OSError as error:
        raise unusable_file(path, error, SETTINGS) from error
    written = read_yaml(data, str(path)).value
    if not isinstance(written, dict):
        raise unusable_file(path, "is no mapping" if data.strip() else "is empty", SETTINGS)
    return {str(key): value for key, value in written.items()}


@one_thread()
def calibrate(
    data: Path, loaded: LoadedSpec, options: FitOptions, progress: Progress, noise: Path | None = None
) -> tuple[Calibration, ...]:
    """Dwell table's file and spec → the calibration of every unit in it.

    noise: account of a reduction, whose noise of samples goes to the random characteristics.
    Raises NothingFound when the data determine nothing of it.
    """
    progress(f"reading {data}")
    table = _records_of(data, options)
    found = calibrate_table(table, loaded.spec, options, spec_sha256=loaded.sha256, progress=progress)
    refuse_nothing(found, options.method, str(data))
    if noise is not None:
        found = tuple(_with_noise(one, noise_of_account(noise)) for one in found)
    if not any(sensor.smooth for one in found for sensor in one.sensors):
        return found
    progress("what lines between the nodes cost in flight")
    flight = trajectory_of(loaded.spec.trajectory, loaded.folder)
    return tuple(_with_cost(one, loaded.spec, flight) for one in found)


def _records_of(data: Path, options: FitOptions) -> DwellTable:
    """A dwell table, or for the method `sins_outputs` what a navigation log says of the sensors."""
    from planner.dwells.dwell_files import read_dwells

    if options.method != SINS_OUTPUTS:
        return read_dwells(data, motions=True)
    from planner.calibrate.sins_outputs import dwells_of
    from planner.dwells.navigation_log_files import read_navigation_log
    from planner.recordings.formats import reader_of

    return dwells_of(read_navigation_log(data, reader_of(data), options.latitude))


def _with_noise(found: Calibration, noise: Sequence[RandomCharacteristic]) -> Calibration:
    """The sensors with what their samples say of white and coloured noise."""
    sensors = (
        replace(s, random=(*s.random, *(r for r in noise if r.error.partition(".")[0] == s.sensor)))
        for s in found.sensors
    )
    return replace(found, sensors=tuple(sensors))


def _with_cost(found: Calibration, spec: Spec, flight: Trajectory) -> Calibration:
    smooth = [table for sensor in found.sensors for table in sensor.smooth]
    if not smooth:
        return found
    return replace(found, notes=(*found.notes, *lines_in_flight(smooth, spec, flight)))


def apply(calibration: Path, raw: Path, out: Path, columns: Path | None) -> tuple[int, list[str]]:
    """Calibration and a recording's or dwell table's file → the corrected file; rows, and what to know."""
    from planner.calibrate.apply_calibration import correct_dwells, correct_recording, is_dwell_table
    from planner.export.calibration import read_tables
    from planner.recordings.column_map import read_map

    tables = read_tables(calibration)
    if columns is None and is_dwell_table(raw):
        return correct_dwells(raw, out, tables)
    return correct_recording(raw, out, tables, None if columns is None else read_map(columns))
