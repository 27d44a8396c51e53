"""A steady descent on one heading, wings level, the nose along the path."""

from __future__ import annotations

import numpy as np

from planner.nouns.trajectory import Trajectory
from planner.trajectories import (
    Altitude,
    Flight,
    Position,
    Speed,
    fly,
    motion_through,
    quaternion_from_rph,
    text,
)


class GlideParameters(Flight):
    """Settings of `glide`."""

    altitude: Altitude = text("1000 m")
    speed: Speed = text("50 m/s")
    sink: Speed = text("5 m/s")


class Glide:
    """Constant speed north-east-down in the local frame."""

    name = "glide"
    parameters = GlideParameters

    def build(self, parameters: GlideParameters) -> Trajectory:
        """The flight; see GlideParameters."""
        p = parameters
        velocity = np.array([p.speed * np.cos(p.heading), p.speed * np.sin(p.heading), p.sink])
        level, pitch = np.zeros(2), np.full(2, -np.arctan2(p.sink, p.speed))
        attitude = quaternion_from_rph(level, pitch, np.full(2, p.heading))
        motion = motion_through(np.array([0.0, p.duration]), np.tile(velocity, (2, 1)), attitude)
        return fly(self.name, motion, Position(p.latitude, p.longitude, p.altitude), p.time_s, p)


FAMILY = Glide()
