"""A helicopter: take-off, hover, turn on the spot, acceleration to cruise, cruise (K 3.3.1, second flight).

The rotor's thrust stands on the rotor disc, so the fuselage pitches down by atan(a / g) to accelerate, and by
a further trim angle that grows with the square of the speed to hold against drag.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics.earth import gravity
from planner.quantities import Angle, Metres, PositiveSeconds
from planner.trajectories._motion import Motion, Position, fly, motion_through, quaternion_from_rph
from planner.trajectories._parameters import DEG, Flight, Speed, text, within
from planner.trajectories._profile import knots, step, step_rate

# begin and end of each phase as shares of the flight: what is between them is rest, hover or cruise
CLIMB = (0.05, 0.25)
TURN = (0.32, 0.45)
ACCELERATION = (0.45, 0.80)
TRIM_AT_CRUISE = 4.0 * DEG  # nose down; common for light helicopters at 40 m/s


class HelicopterParameters(Flight):
    """Settings of `helicopter`; a positive turn is to the right."""

    duration: Annotated[PositiveSeconds, within(30.0, 86_400.0, "s")] = text("60 s")
    climb: Annotated[Metres, within(0.0, 200.0, "m")] = text("40 m")
    turn: Annotated[Angle, within(-360.0 * DEG, 360.0 * DEG, "deg")] = text("90 deg")
    speed: Annotated[Speed, within(0.0, 80.0, "m/s")] = text("40 m/s")


class Helicopter:
    """Take-off, hover, turn, cruise; the phases stretch with the duration."""

    name = "helicopter"
    parameters = HelicopterParameters

    def build(self, parameters: HelicopterParameters) -> Trajectory:
        """The flight; see HelicopterParameters."""
        p = parameters
        motion = _motion(p, knots(p.duration))
        return fly(self.name, motion, Position(p.latitude, p.longitude, p.altitude), p.time_s, p)


def _motion(p: HelicopterParameters, t: Array) -> Motion:
    climb, turn, acceleration = (
        (begin * p.duration, end * p.duration) for begin, end in (CLIMB, TURN, ACCELERATION)
    )
    heading = p.heading + p.turn * step(t, *turn)
    speed = p.speed * step(t, *acceleration)
    forward = p.speed * step_rate(t, *acceleration)
    trim = TRIM_AT_CRUISE * (speed / 40.0) ** 2
    pitch = -np.arctan2(forward, gravity(p.latitude, p.altitude)) - trim
    down = -p.climb * step_rate(t, *climb)
    velocity = np.stack([speed * np.cos(heading), speed * np.sin(heading), down], axis=1)
    return motion_through(t, velocity, quaternion_from_rph(np.zeros_like(t), pitch, heading))


FAMILY = Helicopter()
