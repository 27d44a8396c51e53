"""What an error of the attitude at the start of a flight does to it: given from outside, or self-aligned.

φ turns the computed attitude against the true one, Ĉ = (I + [φ×]) C, as gyros would that err over the first
sample alone. Given from outside it is one draw a flight. Self-aligned, the computed specific force at rest
has no horizontal part: with f = (0, 0, −g) and the accelerometers' own error C δf,

    φ × f + C δf = (0, 0, ·)   =>   φ_N = −(C δf)_E / g,   φ_E = (C δf)_N / g

so that the tilt is tied to their errors, and hides part of what they do in flight (P. D. Groves, Principles
of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd edition, 5.6.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics import earth
from planner.physics.blocks import Indices
from planner.physics.error_dynamics import errors_at
from planner.spec.references import InitialAlignment


def turned(trajectory: Trajectory, instants: Array) -> Array:
    """(m, 9, 3) errors of navigation at the instants per radian of φ north, east, down at the start."""
    forcing = _Turn(trajectory)
    found = errors_at(trajectory, forcing, forcing.active, 3, instants.tolist())
    return np.concatenate([found.position, found.velocity, found.attitude], axis=1)


def by_chance(trajectory: Trajectory, alignment: InitialAlignment) -> Array:
    """(3, 3) columns: φ of one sigma of roll, of pitch, of heading.

    They turn about the forward axis, about the horizontal axis across it, and about the vertical.
    """
    forward = trajectory.attitude[0][:, 0]
    heading = np.arctan2(forward[1], forward[0])
    pitch = np.array([-np.sin(heading), np.cos(heading), 0.0])
    sigmas = [alignment.roll_pitch, alignment.roll_pitch, alignment.heading]
    return np.column_stack([forward, pitch, [0.0, 0.0, 1.0]]) * sigmas


def levelled(trajectory: Trajectory, force_error: Array) -> Array:
    """(3, t) φ of a self-alignment with accelerometers that err by force_error (3, t), body axes, m/s²."""
    north, east, _ = trajectory.attitude[0] @ force_error
    g = float(earth.gravity(trajectory.latitude[0], trajectory.altitude[0]))
    return np.stack([-east, north, np.zeros_like(north)]) / g


@dataclass(frozen=True)
class _Turn:
    """Forcing of the gyros over the first sample: a turn of one radian about north, east, down."""

    trajectory: Trajectory

    def active(self, start: int, stop: int) -> Indices:
        """All three columns where the flight begins, none after it."""
        del stop
        return np.arange(3 if start == 0 else 0)

    def __call__(self, start: int, stop: int) -> tuple[list[Array], list[Array]]:
        """Active columns of the gyros and of the accelerometers over the samples start..stop."""
        columns = np.zeros((stop - start, 3, 3 if start == 0 else 0))
        if start == 0:
            step = float(self.trajectory.time_s[1] - self.trajectory.time_s[0])
            columns[0] = self.trajectory.attitude[0].T / step
        return [columns], []
