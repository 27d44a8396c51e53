"""Straight and level at constant speed and heading (a rhumb line): the cruise of an aircraft."""

from __future__ import annotations

import numpy as np

from planner.nouns.trajectory import Trajectory
from planner.trajectories._motion import Position, fly, motion_through, quaternion_from_rph
from planner.trajectories._parameters import Altitude, Flight, Speed, text


class LevelParameters(Flight):
    """Settings of `level`."""

    altitude: Altitude = text("1000 m")
    speed: Speed = text("50 m/s")


class Level:
    """Cruise without wind: the nose points along the velocity, wings and fuselage level."""

    name = "level"
    parameters = LevelParameters

    def build(self, parameters: LevelParameters) -> Trajectory:
        """The flight; see LevelParameters."""
        p = parameters
        ends = np.array([0.0, p.duration])
        velocity = p.speed * np.array([np.cos(p.heading), np.sin(p.heading), 0.0])
        level = np.zeros(2)
        attitude = quaternion_from_rph(level, level, np.full(2, p.heading))
        motion = motion_through(ends, np.tile(velocity, (2, 1)), attitude)
        return fly(self.name, motion, Position(p.latitude, p.longitude, p.altitude), p.time_s, p)


FAMILY = Level()
