"""A coordinated turn: roll into the bank, then ψ' = g tan(bank) / V; no specific force acts sideways."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from planner.nouns.trajectory import Trajectory
from planner.physics.earth import gravity
from planner.quantities import Angle, PositiveSeconds
from planner.trajectories._motion import Position, fly, motion_through, quaternion_from_rph
from planner.trajectories._parameters import DEG, Altitude, Flight, Speed, text, within
from planner.trajectories._profile import knots, step


class TurnParameters(Flight):
    """Settings of `turn`; a positive bank turns right."""

    altitude: Altitude = text("1000 m")
    speed: Annotated[Speed, within(5.0, 2000.0, "m/s")] = text("50 m/s")
    bank: Annotated[Angle, within(-80.0 * DEG, 80.0 * DEG, "deg")] = text("30 deg")
    roll_in: Annotated[PositiveSeconds, within(1.0, 600.0, "s")] = text("5 s")


class Turn:
    """Level flight that rolls into a turn and stays in it."""

    name = "turn"
    parameters = TurnParameters

    def build(self, parameters: TurnParameters) -> Trajectory:
        """The flight; see TurnParameters."""
        from scipy.interpolate import CubicSpline

        p = parameters
        t = knots(p.duration)
        roll = p.bank * step(t, 0.0, p.roll_in)
        rate = gravity(p.latitude, p.altitude) * np.tan(roll) / p.speed
        heading = p.heading + CubicSpline(t, rate).antiderivative()(t)
        velocity = p.speed * np.stack([np.cos(heading), np.sin(heading), np.zeros_like(t)], axis=1)
        motion = motion_through(t, velocity, quaternion_from_rph(roll, np.zeros_like(t), heading))
        return fly(self.name, motion, Position(p.latitude, p.longitude, p.altitude), p.time_s, p)


FAMILY = Turn()
