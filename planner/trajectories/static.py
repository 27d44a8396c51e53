"""At rest on the ground: the readings are the Earth's rate and gravity."""

from __future__ import annotations

import numpy as np

from planner.nouns.trajectory import Trajectory
from planner.quantities import Angle
from planner.trajectories._motion import Position, fly, motion_through, quaternion_from_rph
from planner.trajectories._parameters import Flight, text


class StaticParameters(Flight):
    """Settings of `static`."""

    roll: Angle = text("0 deg")
    pitch: Angle = text("0 deg")


class Static:
    """A unit that stands still in any attitude."""

    name = "static"
    parameters = StaticParameters

    def build(self, parameters: StaticParameters) -> Trajectory:
        """The rest; see StaticParameters."""
        p = parameters
        time_s = p.time_s
        ends = np.array([0.0, p.duration])
        attitude = quaternion_from_rph(*(np.full(2, angle) for angle in (p.roll, p.pitch, p.heading)))
        motion = motion_through(ends, np.zeros((2, 3)), attitude)
        return fly(self.name, motion, Position(p.latitude, p.longitude, p.altitude), time_s, p)


FAMILY = Static()
