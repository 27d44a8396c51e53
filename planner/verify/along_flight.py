"""What a flight exposes the sensors to, how far two are apart, and what of it a requirement asks for."""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.trajectory import Trajectory
from planner.physics.attitude import rph_from_dcm, wrapped
from planner.physics.earth import principal_radii
from planner.physics.strapdown import NavigationState
from planner.spec.model import Spec

COMPONENTS = {
    "position": ("position", slice(0, 3)),
    "horizontal": ("position", slice(0, 2)),
    "north": ("position", slice(0, 1)),
    "east": ("position", slice(1, 2)),
    "up": ("position", slice(2, 3)),
    "velocity": ("velocity", slice(0, 3)),
    "attitude": ("attitude", slice(0, 3)),
    "roll_pitch": ("attitude", slice(0, 2)),
    "heading": ("attitude", slice(2, 3)),
}


def conditions_of(trajectory: Trajectory, start: int, stop: int) -> Conditions:
    """Means over the sampling intervals start..stop of the flight."""
    step = trajectory.time_s[1] - trajectory.time_s[0]
    warm, on = (
        (x[start:stop] + x[start + 1 : stop + 1]) / 2.0
        for x in (trajectory.temperature_degc, trajectory.time_on)
    )
    return Conditions(
        rate=trajectory.angle_increment[start:stop] / step,
        specific_force=trajectory.velocity_increment[start:stop] / step,
        temperature_degc=warm,
        temperature_rate=np.diff(trajectory.temperature_degc[start : stop + 1]) / step,
        time_on=on,
        day=np.full(stop - start, trajectory.day),
    )


def day_of(trajectory: Trajectory, spec: Spec, end_day: float = 0.0) -> float:
    """The day of a flight: the one that it says, or `flown_after` the end of the campaign, on `end_day`."""
    return trajectory.day if trajectory.day > 0 else end_day + spec.flown_after_days


def start_of(trajectory: Trajectory) -> NavigationState:
    """Where the flight begins."""
    t = trajectory
    return NavigationState(t.latitude[0], t.longitude[0], t.altitude[0], t.velocity[0], t.attitude[0])


def height_of(trajectory: Trajectory) -> tuple[Array, Array] | None:
    """What an aid holds the vertical channel to: altitude and velocity down (n + 1,); None without one."""
    if trajectory.height_aid_m is None:
        return None
    return trajectory.altitude, trajectory.velocity[:, 2]


def apart(computed: NavigationState, true: NavigationState) -> tuple[Array, Array, Array]:
    """(..., 3) each, computed − true: position and velocity north, east, up; roll, pitch, heading."""
    meridian, transverse = principal_radii(true.latitude)
    position = [
        (computed.latitude - true.latitude) * (meridian + true.altitude),
        wrapped(computed.longitude - true.longitude) * (transverse + true.altitude) * np.cos(true.latitude),
        computed.altitude - true.altitude,
    ]
    pairs = zip(rph_from_dcm(computed.attitude), rph_from_dcm(true.attitude), strict=True)
    angles = [wrapped(a - b) for a, b in pairs]
    velocity = (computed.velocity - true.velocity) * np.array([1.0, 1.0, -1.0])
    return np.stack(position, axis=-1), velocity, np.stack(angles, axis=-1)
