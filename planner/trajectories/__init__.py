"""One file a family of flights. A family in a package of one's own builds on the names below."""

from planner.trajectories._motion import Position, fly, motion_through, quaternion_from_rph
from planner.trajectories._parameters import Altitude, Flight, Heading, Speed, text

__all__ = [
    "Altitude",
    "Flight",
    "Heading",
    "Position",
    "Speed",
    "fly",
    "motion_through",
    "quaternion_from_rph",
    "text",
]
