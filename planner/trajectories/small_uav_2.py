"""A small UAV that manoeuvres with up to 80 g: air launch, boost, weaves in every plane (K 3.3.1, third).

It steers without banking: the forces act across the nose, which follows the path, while the body is rolled
once, by 45 deg, to fly with its fins in an X. Manoeuvres come in pairs of opposite sign.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from planner.nouns.trajectory import Trajectory
from planner.quantities import Acceleration, Angle, PositiveSeconds
from planner.trajectories._motion import Position, fly
from planner.trajectories._parameters import DEG, Altitude, Flight, Speed, text, within
from planner.trajectories._point_mass import Command, Forces, PathState, drag, follow
from planner.trajectories._profile import knots, pulse, step
from planner.units import STANDARD_GRAVITY_MPS2

BOOST_S = (1.0, 5.0)
RISE_S = 0.4
ROLL_SHARE = (0.10, 0.14)  # of the flight
DRAG_PER_M = 2e-5  # k = ρ₀ c_d A / (2 m): a slender body of 0.13 m diameter, 100 kg, c_d 0.25


class Manoeuvre(NamedTuple):
    """One pull: its middle as a share of the flight, how long, and its load as shares of the largest load."""

    middle: float
    duration_s: float
    right: float
    up: float


MANOEUVRES = (
    Manoeuvre(0.20, 2.0, 0.0, 0.25),
    Manoeuvre(0.25, 2.0, 0.0, -0.25),
    Manoeuvre(0.35, 2.0, 0.4, 0.0),
    Manoeuvre(0.40, 2.0, -0.4, 0.0),
    Manoeuvre(0.55, 1.6, 1.0, 0.0),
    Manoeuvre(0.61, 1.6, -1.0, 0.0),
    Manoeuvre(0.75, 1.6, 0.0, 0.5),
    Manoeuvre(0.81, 1.6, 0.0, -0.5),
    Manoeuvre(0.90, 1.6, 0.3, 0.3),
    Manoeuvre(0.95, 1.6, -0.3, -0.3),
)


class SmallUav2Parameters(Flight):
    """Settings of `small_uav_2`; `load` is the largest force across the path."""

    duration: Annotated[PositiveSeconds, within(40.0, 300.0, "s")] = text("60 s")
    altitude: Altitude = text("6000 m")
    speed: Annotated[Speed, within(100.0, 1000.0, "m/s")] = text("250 m/s")
    boost_acceleration: Annotated[
        Acceleration, within(10.0 * STANDARD_GRAVITY_MPS2, 40.0 * STANDARD_GRAVITY_MPS2, "g")
    ] = text("20 g")
    load: Annotated[Acceleration, within(0.0, 80.0 * STANDARD_GRAVITY_MPS2, "g")] = text("80 g")
    roll: Annotated[Angle, within(-180.0 * DEG, 180.0 * DEG, "deg")] = text("45 deg")


class SmallUav2:
    """Boosted, steered flight."""

    name = "small_uav_2"
    parameters = SmallUav2Parameters

    def build(self, parameters: SmallUav2Parameters) -> Trajectory:
        """The flight; see SmallUav2Parameters."""
        p = parameters
        start = PathState(p.speed, 0.0, p.heading, p.altitude)
        t = knots(p.duration)
        begin, end = (share * p.duration for share in ROLL_SHARE)
        motion = follow(_command(p), start, p.roll * step(t, begin, end), t)
        return fly(self.name, motion, Position(p.latitude, p.longitude, p.altitude), p.time_s, p)


def _command(p: SmallUav2Parameters) -> Command:
    def forces(time_s: float, state: PathState) -> Forces:
        thrust = p.boost_acceleration * float(pulse(time_s, *BOOST_S, RISE_S))
        right = up = 0.0
        for pull in MANOEUVRES:
            middle, half = pull.middle * p.duration, 0.5 * pull.duration_s
            if abs(time_s - middle) < half:
                share = float(pulse(time_s, middle - half, middle + half, RISE_S))
                right, up = right + p.load * pull.right * share, up + p.load * pull.up * share
        lift = STANDARD_GRAVITY_MPS2 * float(
            np.cos(state.climb_angle)
        )  # carries the weight between the pulls
        return Forces(thrust - drag(DRAG_PER_M, state), right, up + lift)

    return forces


FAMILY = SmallUav2()
