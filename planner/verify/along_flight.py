"""What a flight exposes the sensors to, and which of its errors a requirement asks for."""

from __future__ import annotations

import numpy as np

from planner.records import Conditions, Trajectory

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
