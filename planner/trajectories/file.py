"""A user's flight from a CSV file: position, velocity and attitude at any rate from 1 to 1000 Hz.

The velocity's spline is what moves the vehicle: a spline of rounded positions would put the rounding, twice
differentiated, into the accelerometers. What the integrated velocity slowly leaves over against the file's
positions is fitted by a smooth curve and added, so that the flight stays on the file. The attitude is a
spline through the file's quaternions. What a file leaves out is derived (`_derived`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.trajectories._derived import completed
from planner.trajectories._motion import Curve, Motion, Position, fly, motion_through
from planner.trajectories._parameters import Environment
from planner.trajectories._smooth import smooth
from planner.trajectories._table import Table, read_table
from planner.trajectories._table_checks import check_motion, check_rows, moved, quaternion, velocity

RATE_HZ = 100.0  # of the internal grid, whatever the file's rate
MOST_INTERVALS = 1_000_000  # 2.8 h at 100 Hz; longer flights get a coarser grid
MOST_PANELS = 20
CORRECTION_KNOTS_S = 10.0  # and at least ten rows: 1 cm of rounding must not become an acceleration


class FileParameters(Environment):
    """Settings of `file`; `temperature` is used when the file has no column temp_degc."""

    file: str


class File:
    """A recorded or simulated flight of somebody else's."""

    name = "file"
    parameters = FileParameters

    def build(self, parameters: FileParameters) -> Trajectory:
        """The flight in the file. Raises InputError with the line of everything that is wrong."""
        return _trajectory(flight_table(Path(parameters.file)), parameters)


def flight_table(path: Path) -> Table:
    """The file's rows, with what was left out derived. Raises InputError with the line of what is wrong."""
    try:
        state = path.stat()
    except (OSError, ValueError):  # also a name that no file system takes; reading it says so
        return _table.__wrapped__(path, None)
    return _table(path, (state.st_mtime_ns, state.st_size))


@lru_cache(maxsize=2)  # a spec is checked before its flight is flown: the file is read once
def _table(path: Path, _state: tuple[int, int] | None) -> Table:
    table = read_table(path)
    check_rows(table)
    table = completed(table)
    check_motion(table)
    return table


def _trajectory(table: Table, parameters: FileParameters) -> Trajectory:
    time = table.column("time_s") - table.column("time_s")[0]
    grid = _grid(float(time[-1]))
    start = Position(
        float(np.radians(table.column("lat_deg")[0])),
        float(np.radians(table.column("lon_deg")[0])),
        float(table.column("alt_m")[0]),
    )
    panels = int(np.clip(np.ceil(grid[1] / np.median(np.diff(time)) - 0.01), 1, MOST_PANELS))
    flight = fly(table.path.stem, _motion(table, time), start, grid, parameters, panels=panels)
    if "temp_degc" not in table.columns:
        return flight
    return replace(flight, temperature_degc=np.interp(grid, time, table.column("temp_degc")))


def _grid(duration: float) -> Array:
    intervals = int(np.clip(round(duration * RATE_HZ), 2, MOST_INTERVALS))
    return np.linspace(0.0, duration, intervals + 1)


def _motion(table: Table, time: Array) -> Motion:
    """The motion through the file's velocities and attitudes, corrected to stay on its positions."""
    motion = motion_through(time, velocity(table), quaternion(table))
    if len(time) < 20:  # too few rows to tell drift from rounding
        return motion
    spacing = max(CORRECTION_KNOTS_S, 10.0 * float(np.median(np.diff(time))))
    off = smooth(time, _left_over(motion, time, moved(table)), spacing)
    return replace(
        motion,
        velocity=_sum(motion.velocity, off.derivative(1)),
        acceleration=_sum(motion.acceleration, off.derivative(2)),
    )


def _left_over(motion: Motion, time: Array, by_position: Array) -> Array:
    """(m, 3) metres: the way by the positions minus the way by the velocity's spline, from the start."""
    v, a, h = motion.velocity(time), motion.acceleration(time), np.diff(time)[:, np.newaxis]
    by_velocity = 0.5 * h * (v[1:] + v[:-1]) - h**2 / 12.0 * (a[1:] - a[:-1])  # exact for a cubic
    return np.concatenate([np.zeros((1, 3)), np.cumsum(by_position - by_velocity, axis=0)])


def _sum(one: Curve, other: Curve) -> Curve:
    return lambda time_s: one(time_s) + other(time_s)


FAMILY = File()
