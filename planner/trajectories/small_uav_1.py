"""A small UAV on a ballistic arc: rest, boost off a rail, free flight under drag (K 3.3.1, first flight).

In free flight only drag acts, so the specific force is small: what an accelerometer's scale factor costs, it
costs during the boost, and what a gyro's bias costs comes from the boost pointing wrong ever after.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from planner.errors import InputError
from planner.nouns.trajectory import Trajectory
from planner.quantities import Acceleration, Angle, PositiveSeconds
from planner.trajectories._motion import Position, fly
from planner.trajectories._parameters import DEG, Flight, text, within
from planner.trajectories._point_mass import Command, Forces, PathState, drag, follow
from planner.trajectories._profile import knots, pulse, step
from planner.units import STANDARD_GRAVITY_MPS2

REST_S = 1.0
RISE_S = 0.3  # the motor's ignition and burn-out
ON_RAIL_S = 0.6  # from ignition; then the rail lets go within another RISE_S
DRAG_PER_M = 6e-5  # k = ρ₀ c_d A / (2 m): a slender body of 0.15 m diameter, 50 kg, c_d 0.3


class SmallUav1Parameters(Flight):
    """Settings of `small_uav_1`; the defaults come down near the launching height after one minute."""

    duration: Annotated[PositiveSeconds, within(5.0, 600.0, "s")] = text("60 s")
    elevation: Annotated[Angle, within(10.0 * DEG, 85.0 * DEG, "deg")] = text("50 deg")
    boost_acceleration: Annotated[
        Acceleration, within(3.0 * STANDARD_GRAVITY_MPS2, 80.0 * STANDARD_GRAVITY_MPS2, "g")
    ] = text("20 g")
    boost_time: Annotated[PositiveSeconds, within(1.0, 20.0, "s")] = text("2.5 s")


class SmallUav1:
    """Ballistic flight without control: the nose follows the path."""

    name = "small_uav_1"
    parameters = SmallUav1Parameters

    def build(self, parameters: SmallUav1Parameters) -> Trajectory:
        """The flight; see SmallUav1Parameters. Raises InputError when it comes down before its end."""
        p = parameters
        start = PathState(0.0, p.elevation, p.heading, p.altitude)
        t = knots(p.duration)
        motion = follow(_command(p), start, np.zeros_like(t), t)
        flight = fly(self.name, motion, Position(p.latitude, p.longitude, p.altitude), p.time_s, p)
        _check_above_ground(flight)
        return flight


def _check_above_ground(flight: Trajectory) -> None:
    # 1 m: the rail's support holds the vehicle to within the rounding of g
    below = flight.altitude < flight.altitude[0] - 1.0
    if below.any():
        down = float(flight.time_s[np.argmax(below)])
        raise InputError(
            f"small_uav_1 is down on the height of its launch after {down:.3g} s, before its duration of "
            f"{flight.time_s[-1]:.6g} s; shorten it, or raise elevation, boost_acceleration or boost_time"
        )


def _command(p: SmallUav1Parameters) -> Command:
    def forces(time_s: float, state: PathState) -> Forces:
        thrust = p.boost_acceleration * float(pulse(time_s, REST_S, REST_S + p.boost_time + RISE_S, RISE_S))
        left_rail = REST_S + ON_RAIL_S
        free = float(step(time_s, left_rail, left_rail + RISE_S))
        return Forces(thrust - drag(DRAG_PER_M, state), 0.0, 0.0, free)

    return forces


FAMILY = SmallUav1()
