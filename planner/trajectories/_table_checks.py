"""Whether a trajectory file makes sense: time runs on, values are possible, position and velocity agree."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from planner.errors import Fault
from planner.nouns.array import Array
from planner.physics.earth import principal_radii
from planner.trajectories._motion import quaternion_from_rph
from planner.trajectories._table import MOST_FAULTS, Table, refusal

LONGEST_GAP_S = 2.0
LONGEST_GAP_STEPS = 5.0
SHORTEST_STEP = 0.05  # of the median; nearer rows make an acceleration out of the velocity's rounding
MOST_TURN_DEG = 90.0  # between two rows; beyond it the way the body turned is a guess
MOST_ACCELERATION_MPS2 = 5000.0  # 500 g: a velocity that changes faster is a slip, not a flight
WINDOW_S = 10.0
MANY_JUMPS = 10

NEAREST_POLE_DEG = 89.0  # a strapdown navigator's local frame turns over at the poles

# name: (least, most)
POSSIBLE = {
    "lat_deg": (-90.0, 90.0),
    "lon_deg": (-360.0, 360.0),
    "alt_m": (-1000.0, 1_000_000.0),
    "v_north_mps": (-12_000.0, 12_000.0),
    "v_east_mps": (-12_000.0, 12_000.0),
    "v_down_mps": (-12_000.0, 12_000.0),
    "roll_deg": (-360.0, 360.0),
    "pitch_deg": (-90.0, 90.0),
    "heading_deg": (-360.0, 360.0),
    "temp_degc": (-273.15, 1000.0),
}
_AXES = ("north", "east", "down")
_OF_AXIS = ("lat_deg", "lon_deg", "alt_m")


def check_rows(table: Table) -> None:
    """Raises InputError with every fault of the kind that is found first: times, then ranges."""
    _refuse(table, _times, _ranges)


def check_motion(table: Table) -> None:
    """Raises InputError where positions, velocities and attitudes of a whole table are of no one flight."""
    _refuse(table, _motion)


def _refuse(table: Table, *checks: Callable[[Table], Iterator[Fault]]) -> None:
    for check in checks:
        faults = list(islice(check(table), MOST_FAULTS))
        if faults:
            raise refusal(table.path, [_of_derived(table, fault) for fault in faults])


def _of_derived(table: Table, fault: Fault) -> Fault:
    """A fault of the motion where a part of it was derived: the file is wrong in what it lacks alone."""
    if not table.derived or fault.code not in ("P615", "P616", "P617"):
        return fault
    lacking = "velocity" if fault.code != "P617" or "velocity" in table.remarks[0] else "attitude"
    what = fault.message.partition("; ")[0]
    return replace(fault, message=f"{what}; the {lacking} was derived and does not suit: add its columns")


def moved(table: Table) -> Array:
    """(m − 1, 3) metres north, east, down from row to row, by the positions; longitude may pass ±180 deg."""
    longitude = np.unwrap(table.column("lon_deg"), period=360.0)
    return _steps(np.radians(table.column("lat_deg")), np.radians(longitude), table.column("alt_m"))


def _steps(latitude: Array, longitude: Array, altitude: Array) -> Array:
    middle, height = 0.5 * (latitude[1:] + latitude[:-1]), 0.5 * (altitude[1:] + altitude[:-1])
    meridian, transverse = principal_radii(middle)
    north = (meridian + height) * np.diff(latitude)
    east = (transverse + height) * np.cos(middle) * np.diff(longitude)
    return np.stack([north, east, -np.diff(altitude)], axis=1)


def velocity(table: Table) -> Array:
    """(m, 3) north, east, down in m/s."""
    return np.stack([table.column(f"v_{axis}_mps") for axis in _AXES], axis=1)


def quaternion(table: Table) -> Array:
    """(m, 4) attitude."""
    return quaternion_from_rph(*(np.radians(table.column(f"{a}_deg")) for a in ("roll", "pitch", "heading")))


def _times(table: Table) -> Iterator[Fault]:
    time = table.column("time_s")
    step = np.diff(time)
    for row in np.flatnonzero(step <= 0.0) + 1:
        what = "repeats" if time[row] == time[row - 1] else "is before"
        message = f"{time[row]:.10g} s {what} the time of the row before, {time[row - 1]:.10g} s"
        yield table.fault("P611", int(row), "time_s", message)
    if (step <= 0.0).any():
        return
    for row in np.flatnonzero(step < SHORTEST_STEP * np.median(step)) + 1:
        message = (
            f"only {step[row - 1]:.3g} s after the row before; rows are {np.median(step):.6g} s apart: "
            "leave one of the two out"
        )
        yield table.fault("P611", int(row), "time_s", message)
    longest = min(LONGEST_GAP_S, LONGEST_GAP_STEPS * float(np.median(step)))
    for row in np.flatnonzero(step > longest * (1.0 + 1e-9)) + 1:
        message = (
            f"a gap of {step[row - 1]:.6g} s after {time[row - 1]:.10g} s; rows are {np.median(step):.6g} s "
            f"apart, and {longest:.6g} s is the most that can be bridged"
        )
        yield table.fault("P612", int(row), "time_s", message)


def _ranges(table: Table) -> Iterator[Fault]:
    for name in table.columns:
        if name not in POSSIBLE:
            continue
        least, most = POSSIBLE[name]
        values = table.column(name)
        for first, count in _stretches((values < least) | (values > most)):
            message = f"{values[first]:.10g} is not between {least:g} and {most:g}{_and_more(count)}"
            yield table.fault("P613", first, name, message)
    latitude = np.abs(table.column("lat_deg"))
    for first, count in _stretches((latitude > NEAREST_POLE_DEG) & (latitude <= 90.0)):
        message = (
            f"{table.column('lat_deg')[first]:.10g} deg{_and_more(count)}: nearer than a degree to the pole, "
            "where north turns over and with it every velocity and heading; cut the flight before it"
        )
        yield table.fault("P614", first, "lat_deg", message)


def _stretches(wrong: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """(first row, number of rows) of every stretch of rows that are wrong."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], wrong, [False]]).astype(int)))
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        yield first, end - first


def _and_more(count: int) -> str:
    return f", and so in {count - 1} more after it" if count > 1 else ""


def _motion(table: Table) -> Iterator[Fault]:
    step = np.diff(table.column("time_s"))
    by_position, v = moved(table), velocity(table)
    by_velocity = 0.5 * (v[1:] + v[:-1]) * step[:, np.newaxis]
    if (hint := _radians_hint(table, by_velocity)) is not None:
        yield hint
        return
    jumps = list(islice(_jumps(table, step, by_position, by_velocity), MANY_JUMPS))
    if not jumps or len(jumps) == MANY_JUMPS:  # a few jumps also drift; many are one mistake throughout
        yield from _drifts(table, by_position, by_velocity)
    yield from jumps
    yield from _velocity_jumps(table, step)
    yield from _attitude_jumps(table)


def _jumps(table: Table, step: Array, by_position: Array, by_velocity: Array) -> Iterator[Fault]:
    """A row's position against the row before and the mean velocity between them.

    Tolerance: 1.5 m, more than noise and the last of five decimals of a degree, plus half of what the
    velocity's change makes uncertain, plus 2 % of the way.
    """
    change = np.diff(velocity(table), axis=0)
    uncertain = 0.5 * np.linalg.norm(change, axis=1) * step + 0.02 * np.linalg.norm(by_velocity, axis=1)
    off = np.abs(by_position - by_velocity)
    for row in np.flatnonzero(off.max(axis=1) > 1.5 + uncertain):
        axis = int(off[row].argmax())
        message = (
            f"the position jumps {by_position[row, axis]:+.6g} m {_AXES[axis]} in {step[row]:.6g} s; "
            f"the velocity makes it {by_velocity[row, axis]:+.6g} m"
        )
        yield table.fault("P615", int(row) + 1, _OF_AXIS[axis], message)


def _velocity_jumps(table: Table, step: Array) -> Iterator[Fault]:
    change = np.diff(velocity(table), axis=0)
    # 0.1 m/s: a coarsely rounded velocity at a high rate is no jump
    too_fast = np.abs(change) > MOST_ACCELERATION_MPS2 * step[:, np.newaxis] + 0.1
    for row in np.flatnonzero(too_fast.any(axis=1)):
        axis = int(np.abs(change[row]).argmax())
        message = f"the velocity jumps by {change[row, axis]:+.6g} m/s in {step[row]:.6g} s, more than 500 g"
        yield table.fault("P616", int(row) + 1, f"v_{_AXES[axis]}_mps", message)


def _attitude_jumps(table: Table) -> Iterator[Fault]:
    q = quaternion(table)
    cosine = np.clip(np.abs(np.sum(q[1:] * q[:-1], axis=1)), 0.0, 1.0)
    turn = np.degrees(2.0 * np.arccos(cosine))
    for row in np.flatnonzero(turn > MOST_TURN_DEG):
        message = f"the attitude turns by {turn[row]:.4g} deg from the row before; sample it more finely"
        yield table.fault("P617", int(row) + 1, "heading_deg", message)


def _drifts(table: Table, by_position: Array, by_velocity: Array) -> Iterator[Fault]:
    """The way over ten seconds: a wrong sign, unit or column is too small to be seen from row to row."""
    time = table.column("time_s")
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(by_velocity, axis=1))])
    off = np.concatenate([np.zeros((1, 3)), np.cumsum(by_position - by_velocity, axis=0)])
    end = np.searchsorted(time, time + WINDOW_S).clip(max=len(time) - 1)
    drift = np.abs(off[end] - off)
    excess = drift.max(axis=1) - (5.0 + 0.03 * (way[end] - way))
    row = int(excess.argmax())
    if excess[row] > 0.0:
        axis = int(drift[row].argmax())
        part = slice(row, int(end[row]))
        message = (
            f"from {time[row]:.10g} s to {time[end[row]]:.10g} s the position moves "
            f"{by_position[part, axis].sum():+.6g} m {_AXES[axis]}, but v_{_AXES[axis]}_mps makes it "
            f"{by_velocity[part, axis].sum():+.6g} m: check units and signs"
        )
        yield table.fault("P615", int(end[row]), _OF_AXIS[axis], message)


def _radians_hint(table: Table, by_velocity: Array) -> Fault | None:
    """Angles in radians: the positions fit the velocity if they are, or the heading the course if it is."""
    if _fits_radians(table, by_velocity):
        return table.fault(
            "P618", 0, "lat_deg", "latitude and longitude are in radians; this file's are in degrees"
        )
    v, heading = velocity(table), table.column("heading_deg")
    fast = np.linalg.norm(v[:, :2], axis=1) > 5.0
    if not fast.any() or np.abs(heading).max() > 2.0 * np.pi:
        return None
    course = np.degrees(np.arctan2(v[fast, 1], v[fast, 0]))
    away, away_if_radians = (
        np.abs((course - angle + 180.0) % 360.0 - 180.0)
        for angle in (heading[fast], np.degrees(heading[fast]))
    )
    if np.median(away) > 20.0 and np.quantile(away_if_radians, 0.9) < 5.0:
        message = (
            "the attitude is in radians; this file's is in degrees (the course over ground fits radians)"
        )
        return table.fault("P618", 0, "heading_deg", message)
    return None


def _fits_radians(table: Table, by_velocity: Array) -> bool:
    latitude, longitude = table.column("lat_deg"), table.column("lon_deg")
    way = np.abs(by_velocity[:, :2]).sum()
    if way < 20.0 or np.abs(latitude).max() > 0.5 * np.pi:
        return False
    read, if_radians = moved(table), _steps(latitude, longitude, table.column("alt_m"))
    off, off_if_radians = (np.abs((by - by_velocity)[:, :2]).sum() for by in (read, if_radians))
    return bool(off > 0.5 * way and off_if_radians < 0.05 * way)
