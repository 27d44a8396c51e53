"""A vehicle that flies along its nose under commanded specific forces: speed, flight-path angle, course.

    V' = f_forward − w g sinγ,   V γ' = f_up − w g cosγ,   V cosγ χ' = f_right,   h' = V sinγ

(flat Earth, gravity g constant; w = 0 while something carries the vehicle, e.g. a launch rail). This gives
velocity and attitude; the ideal readings are derived from these with true gravity and the Earth's rate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array
from planner.trajectories._motion import Motion, motion_through, quaternion_from_rph
from planner.units import STANDARD_GRAVITY_MPS2

STEPS_BETWEEN_KNOTS = 5000  # a knot is 10 ms; where a rail lets go some hundred are taken
SCALE_HEIGHT_M = 8500.0  # density falls by e over this height in the lower standard atmosphere


@dataclass(frozen=True)
class Forces:
    """Specific force along, to the right of and above the path, m/s², and the share w of free gravity."""

    forward: float
    right: float
    up: float
    free: float = 1.0


@dataclass(frozen=True)
class PathState:
    """Speed in m/s, flight-path angle and course in rad, altitude in m."""

    speed: float
    climb_angle: float
    course: float
    altitude: float


Command = Callable[[float, PathState], Forces]

_AT_REST_MPS = 1e-3  # below it the path has no direction and keeps the one it has


def follow(command: Command, start: PathState, roll: Array, time_s: Array) -> Motion:
    """The motion under `command` from `start`; roll (m,) about the nose at the knots time_s (m,)."""
    from scipy.integrate import odeint

    initial = [start.speed, start.climb_angle, start.course, start.altitude]

    def rates(time_s: float, y: Array) -> tuple[float, float, float, float]:
        state = PathState(*y.tolist())
        return _rates(command(time_s, state), state)

    # LSODA (Petzold 1983) runs from knot to knot outside Python. 0.1 s: no manoeuvre is short enough to be
    # stepped over; tolerance: kinks below 1e-6 m/s² between knots
    flown = odeint(
        rates, initial, time_s, tfirst=True, rtol=1e-12, atol=1e-12, hmax=0.1, mxstep=STEPS_BETWEEN_KNOTS
    )
    speed, climb_angle, course, _altitude = flown.T
    level = speed * np.cos(climb_angle)
    velocity = np.stack(
        [level * np.cos(course), level * np.sin(course), -speed * np.sin(climb_angle)], axis=1
    )
    return motion_through(time_s, velocity, quaternion_from_rph(roll, climb_angle, course))


def drag(area: float, state: PathState) -> float:
    """Specific drag k ρ/ρ₀ V² in m/s²; `area` is k = ρ₀ c_d A / (2 m) in 1/m."""
    return area * math.exp(-state.altitude / SCALE_HEIGHT_M) * state.speed**2


def _rates(forces: Forces, state: PathState) -> tuple[float, float, float, float]:
    sin, cos = math.sin(state.climb_angle), math.cos(state.climb_angle)
    weight = forces.free * STANDARD_GRAVITY_MPS2
    speed_rate = forces.forward - weight * sin
    if state.speed < _AT_REST_MPS:
        return speed_rate, 0.0, 0.0, state.speed * sin
    climb_rate = (forces.up - weight * cos) / state.speed
    return speed_rate, climb_rate, forces.right / (state.speed * cos), state.speed * sin
