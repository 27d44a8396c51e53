"""Where a bench's motion puts the unit: its mean specific force and inertial rate over a record.

Rate table of two axes or more (planner.benches.rate_table): at zero body x points north, y west (axis 2), z
up (axis 1); a bench vector r is R_z(−p1) R_y(−p2) r in the body. A unit on a table of one axis, which stands
upright, is remounted between its motions: x, y, z up in turn for every full set of motions.
Centrifuge: the arm turns about the vertical body z and loads the unit with f = −R ω² r_out. On an arm of one
axis the unit is remounted like on a table of one axis: x, y, z up, so that y, z, x lie along the arm in turn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array
from planner.physics.earth import EARTH_RATE_RADPS
from planner.units import STANDARD_GRAVITY_MPS2

UP = np.array([0.0, 0.0, 1.0])
AXIS_2 = np.array([0.0, 1.0, 0.0])
DEFAULT_ARM_M = 1.5


@dataclass(frozen=True)
class Misplaced:
    """How far a bench's references are off. With R(ρ) = exp([ρ×]), so that R(ρ) r ≈ r + ρ × r:

    level (2,) rad: gravity and the Earth's rate reach the base as R((ℓx, ℓy, 0)) r, in bench axes before the
    table turns them; the driven rate does not.  mounting (3,) rad: the unit sees R(δ) u of everything, in
    body axes.  rate: the driven rate is (1 + ε) times what was asked, and the load of a centrifuge (1 + ε)².
    """

    level: Array
    mounting: Array
    rate: float


@dataclass(frozen=True)
class Exposure:
    """Means over one record: rate (3,) rad/s, specific_force (3,) m/s², in the body."""

    rate: Array
    specific_force: Array


@dataclass(frozen=True)
class Asked:
    """What a record asks of its bench: the arguments of `exposure`."""

    motion: Mapping[str, float]
    duration: float
    latitude: float
    arm: float | None
    mount: int

    @property
    def key(self) -> tuple[object, ...]:
        """Equal for records that ask the same."""
        return (*sorted(self.motion.items()), self.duration, self.latitude, self.arm, self.mount)

    def exposed(self, references: Misplaced | None = None) -> Exposure:
        """What the unit is exposed to."""
        asked = self.motion, self.duration, self.latitude
        return exposure(*asked, arm=self.arm, mount=self.mount, references=references)


def exposure(
    motion: Mapping[str, float] | None,
    duration: float,
    latitude: float,
    *,
    arm: float | None = None,
    mount: int = 2,
    references: Misplaced | None = None,
) -> Exposure:
    """What a unit is exposed to during one record of `duration` s at a latitude (rad).

    motion: deg, deg/s and g by axis, as in a plan's step; mount: body axis (0, 1, 2) that lies along axis 1
    references: how far the bench's references are off; None: not at all
    """
    asked = motion or {}
    earth = EARTH_RATE_RADPS * np.array([np.cos(latitude), 0.0, np.sin(latitude)])
    up, faster = UP, 1.0
    turned = mounted(mount)
    if references is not None:
        level, faster = rotation(np.append(references.level, 0.0)), 1.0 + references.rate
        up, earth, turned = level @ up, level @ earth, rotation(references.mounting) @ turned
    if "acceleration_g" in asked:
        return _centrifuge(asked, up, earth, DEFAULT_ARM_M if arm is None else arm, turned, faster)
    p1, p2 = (np.radians(asked.get(f"position_{k}_deg", 0.0)) for k in (1, 2))
    w1, w2 = (np.radians(asked.get(f"rate_{k}_dps", 0.0)) for k in (1, 2))
    up, turn = _mean_in_body(up, p1, p2, w1, w2, duration), _mean_in_body(earth, p1, p2, w1, w2, duration)
    driven = w1 * UP + w2 * _mean_in_body(AXIS_2, p1, p2, w1, 0.0, duration)
    return Exposure(turned @ (turn + faster * driven), STANDARD_GRAVITY_MPS2 * (turned @ up))


def rotation(angles: Array) -> Array:
    """(3, 3) exp([ρ×]) of a rotation vector ρ (3,), rad: Rodrigues."""
    size = float(np.linalg.norm(angles))
    if size == 0.0:
        return np.eye(3)
    return np.array([_about(angles / size, np.array([size]), e) for e in np.eye(3)]).T


def mounting(number: int, count: int, axes: int) -> int:
    """Body axis (0, 1, 2) along axis 1 at motion `number` (from 0) of `count`.

    z on a bench of several axes; on one axis x, y, z for a third of the motions each, if there are three.
    """
    return 2 if axes > 1 or count < 3 else min(2, 3 * number // count)


def _mean_in_body(r: Array, p1: float, p2: float, w1: float, w2: float, duration: float) -> Array:
    """Mean over the record of R_z(−p1 − w1 t) R_y(−p2 − w2 t) r.

    Exact when one axis turns; when both do, the mean of many instants.
    """
    if w1 and w2:
        t = (np.arange(20_000) + 0.5) / 20_000 * duration
        tilted = _about(AXIS_2, -(p2 + w2 * t)[:, None], r)
        return np.asarray(_about(UP, -(p1 + w1 * t)[:, None], tilted).mean(axis=0))
    tilted = _mean_about(AXIS_2, -p2, -w2 * duration, r)
    return _mean_about(UP, -p1, -w1 * duration, tilted)


def _about(axis: Array, angle: Array, r: Array) -> Array:
    """Rodrigues: r (3,) or (n, 3) turned about a unit axis (3,) by angles (1,) or (n, 1)."""
    along = axis * np.asarray(r @ axis)[..., None]
    return np.asarray(along + (r - along) * np.cos(angle) + np.cross(axis, r) * np.sin(angle))


def _mean_about(axis: Array, start: float, sweep: float, r: Array) -> Array:
    """Mean of r turned about the axis by start … start + sweep: the chord over the arc."""
    middle = _about(axis, np.array([start + sweep / 2.0]), r)
    along = axis * (axis @ r)
    return np.asarray(along + (middle - along) * np.sinc(sweep / (2.0 * np.pi)))


def in_body(r: Array, p1: Array, p2: Array) -> Array:
    """(n, 3) R_z(−p1) R_y(−p2) r of a bench vector r (3,) at angles (n,) of both axes."""
    return _about(UP, -p1[:, None], _about(AXIS_2, -p2[:, None], r))


def mounted(mount: int) -> Array:
    """The rotation that puts body axis `mount` where z is: a cyclic change of axes."""
    return np.roll(np.eye(3), (mount + 1) % 3, axis=0)


def _centrifuge(
    asked: Mapping[str, float], up: Array, earth: Array, arm: float, turned: Array, faster: float
) -> Exposure:
    """Load along the mounted axis; a signed load on a one-axis centrifuge is f along x with z up.

    up (3,), earth (3,) in bench axes: their horizontal parts turn round with the arm
    """
    load = asked["acceleration_g"] * STANDARD_GRAVITY_MPS2
    rate = np.sqrt(abs(load) / arm)
    if "position_2_deg" in asked:
        outward = np.radians(asked["position_2_deg"])  # body x, y, −x, −y point outwards at 0, 90, 180, 270
        force = -load * np.array([np.cos(outward), np.sin(outward), 0.0])
    else:
        force = np.array([load, 0.0, 0.0])
    return Exposure(
        turned @ ((faster * rate + earth[2]) * UP),
        turned @ (faster**2 * force + STANDARD_GRAVITY_MPS2 * up[2] * UP),
    )
