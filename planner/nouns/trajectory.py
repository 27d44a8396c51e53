"""A flight and the ideal readings that belong to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner.nouns.array import Array


@dataclass(frozen=True)
class Trajectory:
    """A flight and the ideal readings that belong to it, on a uniform time grid of n + 1 instants.

    Body axes forward-right-down, navigation axes north-east-down, WGS-84.
    time_s: (n + 1,) uniform, from 0; latitude, longitude: (n + 1,) rad; altitude: (n + 1,) m
    velocity: (n + 1, 3) north, east, down relative to the Earth, m/s
    attitude: (n + 1, 3, 3) direction cosines C_nb, body to north-east-down
    angle_increment: (n, 3) integral of the ideal gyro readings over each interval, rad
    velocity_increment: (n, 3) integral of the ideal accelerometer readings over each interval, m/s
    temperature_degc: (n + 1,); time_on: (n + 1,) seconds since power-on; day: days since calibration
    height_aid_m: standard deviation of the aid that holds the computed height; None: nothing holds it
    """

    name: str
    time_s: Array
    latitude: Array
    longitude: Array
    altitude: Array
    velocity: Array
    attitude: Array
    angle_increment: Array
    velocity_increment: Array
    temperature_degc: Array
    time_on: Array
    day: float = 0.0
    height_aid_m: float | None = None

    def until(self, seconds: float) -> Trajectory:
        """Up to the first instant at or after `seconds` from the start; the whole where it is shorter."""
        ahead = self.time_s - self.time_s[0] >= seconds * (1.0 - 1e-12)
        n = max(int(np.argmax(ahead)), 2) if ahead.any() else len(self.time_s) - 1
        points = ("time_s", "latitude", "longitude", "altitude", "velocity", "attitude", "temperature_degc")
        return replace(
            self,
            **{name: getattr(self, name)[: n + 1] for name in (*points, "time_on")},
            angle_increment=self.angle_increment[:n],
            velocity_increment=self.velocity_increment[:n],
        )
