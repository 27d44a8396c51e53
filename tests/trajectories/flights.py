"""Flights and independent integrations of their readings, shared by the tests of trajectories."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from planner.catalog import trajectories
from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics import earth
from planner.physics.attitude import rph_from_dcm, skew
from planner.trajectories import _motion
from planner.trajectories._motion import Motion, Position
from planner.trajectories._table import COLUMNS

BUILT_IN = ("helicopter", "level", "small_uav_1", "small_uav_2", "static", "turn")
HEADER = list(COLUMNS)


def flight(name: str, **parameters: Any) -> Trajectory:
    family = trajectories()[name]
    return family.build(family.parameters(**parameters))


def apart(one: Trajectory, other: Trajectory) -> Array:
    """(n + 1,) metres between two flights on the same grid."""
    here, there = (earth.lla_to_ecef(t.latitude, t.longitude, t.altitude) for t in (one, other))
    return np.linalg.norm(here - there, axis=1)


def rph_deg(trajectory: Trajectory) -> Array:
    return np.degrees(np.stack(rph_from_dcm(trajectory.attitude), axis=1))


def mean_force_g(trajectory: Trajectory) -> Array:
    """(n, 3) mean specific force of each interval in g."""
    return trajectory.velocity_increment / np.diff(trajectory.time_s)[:, np.newaxis] / 9.80665


def mean_rate_dps(trajectory: Trajectory) -> Array:
    return np.degrees(trajectory.angle_increment / np.diff(trajectory.time_s)[:, np.newaxis])


def table(trajectory: Trajectory) -> Array:
    """The flight as the rows of a CSV file."""
    angles = rph_deg(trajectory)
    angles[:, 2] %= 360.0
    place = [np.degrees(trajectory.latitude), np.degrees(trajectory.longitude), trajectory.altitude]
    return np.column_stack([trajectory.time_s, *place, trajectory.velocity, angles])


def write(path: Path, rows: Array, *, names: list[str] = HEADER, form: str = "%.10f", top: str = "") -> Path:
    np.savetxt(path, rows, delimiter=",", fmt=form, header=top + ",".join(names), comments="")
    return path


def motion_of(name: str, monkeypatch: Any, **parameters: Any) -> tuple[Trajectory, Motion]:
    """A flight together with the continuous motion that it was sampled from."""
    import importlib

    module, seen = importlib.import_module(f"planner.trajectories.{name}"), []

    def listening(family: str, motion: Motion, *rest: Any, **settings: Any) -> Trajectory:
        seen.append(motion)
        return _motion.fly(family, motion, *rest, **settings)

    monkeypatch.setattr(module, "fly", listening)
    return flight(name, **parameters), seen[0]


def end_by_runge_kutta(trajectory: Trajectory, motion: Motion) -> tuple[float, float]:
    """Integrates the ideal readings in the Earth-fixed frame by the classic fourth-order rule.

        r' = v,   v' = C f + g(r) − 2 Ω × v,   C' = C [ω×] − [Ω×] C

    Returns how far off it ends: metres, and the largest entry of the difference of the attitudes.
    """
    t, h = trajectory.time_s, float(trajectory.time_s[1])
    middle = 0.5 * (t[1:] + t[:-1])
    from scipy.interpolate import CubicSpline

    place = CubicSpline(t, np.stack([trajectory.latitude, trajectory.longitude, trajectory.altitude], axis=1))
    at, between = (_motion.readings(motion, s, Position(*place(s).T)) for s in (t, middle))
    r = earth.lla_to_ecef(
        trajectory.latitude[[0, -1]], trajectory.longitude[[0, -1]], trajectory.altitude[[0, -1]]
    )
    to_earth = earth.ecef_from_ned(trajectory.latitude[[0, -1]], trajectory.longitude[[0, -1]])
    state = (r[0], to_earth[0] @ trajectory.velocity[0], to_earth[0] @ trajectory.attitude[0])
    for k in range(len(middle)):
        first, half, last = ((x[0][i], x[1][i]) for x, i in ((at, k), (between, k), (at, k + 1)))
        k1 = _slope(state, *first)
        k2 = _slope(_moved(state, k1, h / 2), *half)
        k3 = _slope(_moved(state, k2, h / 2), *half)
        k4 = _slope(_moved(state, k3, h), *last)
        state = tuple(
            s + h / 6 * (a + 2 * b + 2 * c + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4, strict=True)
        )
    turned = np.abs(state[2] - to_earth[1] @ trajectory.attitude[-1]).max()
    return float(np.linalg.norm(state[0] - r[1])), float(turned)


_SPIN = np.array([0.0, 0.0, earth.EARTH_RATE_RADPS])


def _slope(state: tuple[Array, ...], rate: Array, force: Array) -> tuple[Array, ...]:
    r, v, attitude = state
    latitude, longitude, altitude = earth.ecef_to_lla(r)
    down = earth.ecef_from_ned(latitude, longitude)[:, 2]
    gravity = float(earth.gravity(latitude, altitude)) * down
    coriolis = 2.0 * skew(_SPIN) @ v
    return v, attitude @ force + gravity - coriolis, attitude @ skew(rate) - skew(_SPIN) @ attitude


def _moved(state: tuple[Array, ...], slope: tuple[Array, ...], h: float) -> tuple[Array, ...]:
    return tuple(s + h * d for s, d in zip(state, slope, strict=True))
