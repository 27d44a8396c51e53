"""What a flight file leaves out: the velocity from its positions, the attitude from the velocity.

    v = dr/dt of the smooth curve through the positions r, north-east-down
    heading = atan2(v_E, v_N),  pitch = atan2(−v_D, |v_NE|),  roll = atan(|v_NE| heading' / g)

The nose lies along the path and turns are coordinated: true of a fixed wing without wind or sideslip, and a
guess of anything that hovers. Below SLOW_MPS there is no course: the heading goes evenly from the last to
the next one, and a file that is so for longer than a start or a landing must have its attitude.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.nouns.array import Array
from planner.trajectories._smooth import smooth
from planner.trajectories._table import ATTITUDE, VELOCITY, Table, refusal
from planner.trajectories._table_checks import moved, velocity
from planner.units import STANDARD_GRAVITY_MPS2

KNOTS_ROWS = (3, 5, 10, 20, 50, 100, 200)  # rows from knot to knot of the curves that are differentiated
ROUGH_MPS2 = 0.05  # noise of the derived acceleration for which the closest knots are taken
FEWEST_ROWS = 12
SLOW_MPS = 2.0
MOST_WITHOUT_COURSE = 0.2  # of the rows
TURN_S = 1.0  # knots of the angles: a roll takes about so long
STEEP = 0.2  # of the vertical speed: steeper than 79 deg a path has no course


def completed(table: Table) -> Table:
    """The table with every column. Raises InputError where what it lacks cannot be derived."""
    if not set(VELOCITY) <= set(table.columns):
        table = _with_velocity(table)
    return table if set(ATTITUDE) <= set(table.columns) else _with_attitude(table)


def _with_velocity(table: Table) -> Table:
    _refuse_few_rows(table, VELOCITY)
    time, path = _time(table), np.concatenate([np.zeros((1, 3)), np.cumsum(moved(table), axis=0)])
    spacing = _spacing(time, path)
    said = f"velocity derived from the positions, by a smooth curve with knots every {spacing:.3g} s"
    return _with(table, VELOCITY, smooth(time, path, spacing)(time, nu=1), said)


def _with_attitude(table: Table) -> Table:
    _refuse_few_rows(table, ATTITUDE)
    time, v = _time(table), velocity(table)
    speed = np.linalg.norm(v[:, :2], axis=1)
    moving = speed > np.maximum(SLOW_MPS, STEEP * np.abs(v[:, 2]))
    without = 1.0 - float(moving.mean())
    if without > MOST_WITHOUT_COURSE:
        why = (
            f"is missing, and cannot be derived: for {without:.0%} of the flight there is no course, slower "
            f"than {SLOW_MPS:g} m/s over ground or nearly upright"
        )
        raise refusal(table.path, [table.fault("P605", 0, name, why) for name in ATTITUDE])
    course = np.unwrap(np.arctan2(v[moving, 1], v[moving, 0]))
    heading = np.interp(time, time[moving], course)
    climb = np.arctan2(-v[:, 2], np.maximum(speed, SLOW_MPS))
    spacing = _spacing(time, np.cumsum(v, axis=0) * float(np.median(np.diff(time))))
    curve = smooth(time, np.stack([climb, heading], axis=1), max(spacing, TURN_S))
    pitch, heading = curve(time).T
    roll = np.arctan(speed * curve(time, nu=1)[:, 1] / STANDARD_GRAVITY_MPS2)
    said = "attitude derived from the velocity: nose along the path, roll of a coordinated turn"
    if without > 0.0:
        said += f"; heading interpolated where there is no course ({without:.0%} of the flight)"
    angles = np.degrees(np.stack([roll, np.clip(pitch, -np.pi / 2, np.pi / 2), heading], axis=1))
    angles[:, 2] = (angles[:, 2] + 180.0) % 360.0 - 180.0
    return _with(table, ATTITUDE, angles, said)


def _with(table: Table, names: tuple[str, ...], values: Array, said: str) -> Table:
    return replace(
        table,
        columns=(*table.columns, *names),
        values=np.concatenate([table.values, values], axis=1),
        derived=(*table.derived, *names),
        remarks=(*table.remarks, said),
    )


def _time(table: Table) -> Array:
    return np.asarray(table.column("time_s") - table.column("time_s")[0])


def _spacing(time: Array, path: Array) -> float:
    """Seconds between knots: the fewest with which the noise of a path (m, 3) makes no acceleration.

    The noise by third differences, 20 σ² each where the path is smooth; their median leaves manoeuvres out.
    A least-squares curve has σ √(rows⁻¹) / h² of it in its second derivative, to a factor of ten.
    """
    step = float(np.median(np.diff(time)))
    noise = 1.4826 * float(np.median(np.abs(np.diff(path, 3, axis=0)), axis=0).max()) / np.sqrt(20.0)
    for rows in KNOTS_ROWS:
        if 10.0 * noise / np.sqrt(rows) / (rows * step) ** 2 < ROUGH_MPS2:
            break
    return rows * step


def _refuse_few_rows(table: Table, names: tuple[str, ...]) -> None:
    if len(table.values) < FEWEST_ROWS:
        why = f"is missing, and cannot be derived from fewer than {FEWEST_ROWS} rows"
        raise refusal(table.path, [table.fault("P605", 0, name, why) for name in names])
