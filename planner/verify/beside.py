"""What flies beside the errors of the calibration: white noise, initial alignment, the height aid's error.

White noise of density N over a stretch of length h is a constant of sigma N/√h, along north, east and down
(three equal channels scatter the same in all axes, so that turns of the body average nothing out). With 32
stretches an error that grows with the square of time misses 0.03 % of its sigma. An error of the initial
attitude is a turn of the first sample. Self-aligned, the accelerometers' own error at the start makes the
computed level: with f = −g down, φ × f + C δf has no horizontal part, φ_E = δf_N/g, φ_N = −δf_E/g.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics import earth
from planner.protocols import SENSORS, Sensor
from planner.spec.model import Spec
from planner.spec.references import InitialAlignment
from planner.verify.chance import Chance
from planner.verify.draws import generator

STRETCHES = 32
STRETCH_S = 60.0  # at most: a Schuler period has 84 of them


ALIGNMENT = "initial alignment"
HEIGHT = "height aid"


def noise_name(sensor: Sensor) -> str:
    """`gyro noise`."""
    return f"{sensor} noise"


@dataclass(frozen=True)
class Beside:
    """noise: sensor -> density per √Hz, SI, of those that have some in flight; edges: (S + 1,) s.

    height: sigma of the height aid, m, one draw a flight that the computed height has all along; 0: none
    """

    noise: dict[Sensor, float]
    edges: Array
    alignment: InitialAlignment | None
    height: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """What there is, in the order of the coefficients."""
        noises = tuple(noise_name(sensor) for sensor in self.noise)
        aligned = () if self.alignment is None else (ALIGNMENT,)
        return (*noises, *aligned, *((HEIGHT,) if self.height > 0 else ()))

    @property
    def stretches(self) -> int:
        """How many stretches of noise."""
        return len(self.edges) - 1

    def columns(
        self, sensor: Sensor, trajectory: Trajectory, start: int, stop: int, stretches: range
    ) -> Array:
        """(n, 3, p) of a sensor over the samples start..stop: noise of some stretches, then the alignment."""
        to_body = np.swapaxes(trajectory.attitude[start:stop], 1, 2)
        parts = [np.empty((stop - start, 3, 0))]
        if sensor in self.noise:
            middle = (trajectory.time_s[start:stop] + trajectory.time_s[start + 1 : stop + 1]) / 2.0
            where = np.searchsorted(self.edges, middle) - 1
            inside = where[:, None] == np.array(stretches)
            parts.append((inside[:, None, :, None] * to_body[:, :, None, :]).reshape(stop - start, 3, -1))
        if sensor == "gyro" and self.alignment is not None and start == 0:
            step = float(trajectory.time_s[1] - trajectory.time_s[0])
            first = (np.arange(start, stop) == 0)[:, None, None]
            parts.append(first * to_body / step)
        return np.concatenate(parts, axis=2)

    def drawn(self, trajectory: Trajectory, units: int, key: tuple[int, int]) -> dict[str, Array]:
        """Name -> (B, p) coefficients: noise by stretch and axis; φ north, east, down, rad."""
        found = {}
        spread = 1.0 / np.sqrt(np.diff(self.edges))
        for sensor, density in self.noise.items():
            z = generator(*key, "flight_noise", sensor).normal(size=(units, len(spread), 3))
            found[noise_name(sensor)] = (density * spread[:, None] * z).reshape(units, -1)
        if self.alignment is not None:
            z = generator(*key, "alignment").normal(size=(units, 3))
            a = self.alignment
            found[ALIGNMENT] = (z * [a.roll_pitch, a.roll_pitch, a.heading]) @ _turns(trajectory).T
        if self.height > 0:
            found[HEIGHT] = self.height * generator(*key, "height_aid").normal(size=(units, 1))
        return found

    def sigmas(self, trajectory: Trajectory) -> dict[str, Array]:
        """Name -> (p, p) coefficients of one sigma of each of its chances, row by row."""
        spread = np.repeat(1.0 / np.sqrt(np.diff(self.edges)), 3)
        found = {noise_name(s): np.diag(density * spread) for s, density in self.noise.items()}
        if self.alignment is not None:
            a = self.alignment
            found[ALIGNMENT] = np.diag([a.roll_pitch, a.roll_pitch, a.heading]) @ _turns(trajectory).T
        if self.height > 0:
            found[HEIGHT] = np.array([[self.height]])
        return found

    def tilt(self, trajectory: Trajectory, force_error: Array) -> Array:
        """(B, 3) φ of a self-alignment with accelerometers that err by force_error (B, 3), body, m/s²."""
        if self.alignment is None or not self.alignment.self_aligned:
            return np.zeros_like(force_error)
        g = float(earth.gravity(trajectory.latitude[0], trajectory.altitude[0]))
        north, east, _ = (force_error @ trajectory.attitude[0].T).T
        return np.stack([-east / g, north / g, np.zeros_like(north)], axis=1)


NOTHING = Beside({}, np.array([0.0, 1.0]), None)


def beside_of(spec: Spec, chance: Chance, trajectory: Trajectory, instants: Array) -> Beside:
    """What the spec says; instants at which errors are wanted begin a stretch."""
    start, end = float(trajectory.time_s[0]), float(trajectory.time_s[-1])
    count = max(STRETCHES, int(np.ceil((end - start) / STRETCH_S)))
    edges = np.unique(np.concatenate([np.linspace(start, end, count + 1), instants]))
    noise = {s: chance.white[s] for s in SENSORS if s in chance.flown and chance.white[s] > 0}
    inside = edges[(edges >= start) & (edges <= end)]
    return Beside(noise, inside, spec.initial_alignment, trajectory.height_aid_m or 0.0)


def _turns(trajectory: Trajectory) -> Array:
    """(3, 3) columns: φ north, east, down of one radian of roll, pitch, heading."""
    forward = trajectory.attitude[0][:, 0]
    level = np.hypot(forward[0], forward[1])
    cos, sin = (1.0, 0.0) if level == 0 else (forward[0] / level, forward[1] / level)
    return np.array([[forward[0], -sin, 0.0], [forward[1], cos, 0.0], [forward[2], 0.0, 1.0]])
