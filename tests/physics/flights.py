"""Smooth analytic flights for tests: polynomial plus one sine in every coordinate, readings by quadrature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from planner.nouns.trajectory import Trajectory
from planner.physics import earth
from planner.physics.attitude import cross, rotate
from planner.physics.earth import Array


@dataclass(frozen=True)
class Curve:
    """x(t) = start + slope t + bend t²/2 + swing sin(2π frequency t), with exact derivatives."""

    start: float = 0.0
    slope: float = 0.0
    bend: float = 0.0
    swing: float = 0.0
    frequency: float = 0.1

    def __call__(self, t: Array) -> tuple[Array, Array, Array]:
        w = 2.0 * np.pi * self.frequency
        x = self.start + self.slope * t + 0.5 * self.bend * t**2 + self.swing * np.sin(w * t)
        first = self.slope + self.bend * t + self.swing * w * np.cos(w * t)
        return x, first, self.bend - self.swing * w**2 * np.sin(w * t)


@dataclass(frozen=True)
class Flight:
    """Six curves: latitude, longitude (rad), altitude (m), roll, pitch, heading (rad)."""

    latitude: Curve = Curve(0.8)
    longitude: Curve = Curve(0.5)
    altitude: Curve = Curve(300.0)
    roll: Curve = Curve()
    pitch: Curve = Curve()
    heading: Curve = Curve()


def state(flight: Flight, t: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Velocity (n, 3), C_nb (n, 3, 3), rate and specific force in body axes (n, 3), position (3, n)."""
    (lat, dlat, ddlat), (lon, dlon, ddlon), (alt, dalt, ddalt) = (
        c(t) for c in (flight.latitude, flight.longitude, flight.altitude)
    )
    (roll, droll, _), (pitch, dpitch, _), (heading, dheading, _) = (
        c(t) for c in (flight.roll, flight.pitch, flight.heading)
    )
    rn, re = earth.principal_radii(lat)
    small = 1e-5
    drn, dre = (
        (b - a) / (2 * small)
        for a, b in zip(earth.principal_radii(lat - small), earth.principal_radii(lat + small), strict=True)
    )
    v = np.stack([(rn + alt) * dlat, (re + alt) * np.cos(lat) * dlon, -dalt], axis=-1)
    dv = np.stack(
        [
            (drn * dlat + dalt) * dlat + (rn + alt) * ddlat,
            (dre * dlat + dalt) * np.cos(lat) * dlon
            + (re + alt) * (-np.sin(lat) * dlat * dlon + np.cos(lat) * ddlon),
            -ddalt,
        ],
        axis=-1,
    )
    w_ie, w_en = earth.earth_rate_ned(lat), earth.transport_rate_ned(lat, alt, v)
    c_bn = Rotation.from_euler("xyz", np.stack([roll, pitch, heading], axis=-1)).inv().as_matrix()
    force = rotate(c_bn, dv + cross(2 * w_ie + w_en, v) - earth.gravity_ned(lat, alt))
    euler = np.stack(
        [
            droll - dheading * np.sin(pitch),
            dpitch * np.cos(roll) + dheading * np.cos(pitch) * np.sin(roll),
            -dpitch * np.sin(roll) + dheading * np.cos(pitch) * np.cos(roll),
        ],
        axis=-1,
    )
    return v, c_bn.swapaxes(-1, -2), euler + rotate(c_bn, w_ie + w_en), force, np.stack([lat, lon, alt])


def fly(flight: Flight, duration: float, rate: float = 100.0, temperature: Curve | None = None) -> Trajectory:
    """The trajectory and its ideal increments; four Gauss points per interval."""
    n = round(duration * rate)
    t = np.arange(n + 1) / rate
    velocity, attitude, _, _, (lat, lon, alt) = state(flight, t)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    angle, increment = np.zeros((n, 3)), np.zeros((n, 3))
    for node, weight in zip(nodes, weights, strict=True):
        _, _, w, f, _ = state(flight, t[:-1] + (0.5 + 0.5 * node) / rate)
        angle += 0.5 * weight / rate * w
        increment += 0.5 * weight / rate * f
    degc = np.full(n + 1, 20.0) if temperature is None else temperature(t)[0]
    return Trajectory("test", t, lat, lon, alt, velocity, attitude, angle, increment, degc, t + 5.0)


MANOEUVRES = Flight(
    latitude=Curve(0.8, 3e-5, 0.0, 2e-5, 0.02),
    longitude=Curve(0.5, 2e-5, 1e-7, 3e-5, 0.03),
    altitude=Curve(1000.0, 3.0, 0.0, 200.0, 0.025),
    roll=Curve(0.1, 0.02, 0.0, 0.8, 0.2),
    pitch=Curve(0.05, 0.0, 0.0, 0.4, 0.13),
    heading=Curve(1.0, 0.05, 0.001, 0.3, 0.07),
)
"""Hundreds of m/s, tens of m/s², tens of deg/s, all three angles moving."""

CRUISE = Flight(
    latitude=Curve(0.9, 2.5e-5, 0.0, 5e-5, 0.004),
    longitude=Curve(-2.0, -3e-5),
    altitude=Curve(9000.0, 0.0, 0.0, 100.0, 0.003),
    roll=Curve(0.0, 0.0, 0.0, 0.3, 0.01),
    pitch=Curve(0.05),
    heading=Curve(-0.8, 0.0, 0.0, 0.5, 0.005),
)
"""An aircraft's leg with gentle turns."""

HARD = Flight(
    latitude=Curve(0.8, 3e-5, 0.0, 2e-5, 0.3),
    longitude=Curve(0.5, 1e-5, 1e-6, 1e-5, 0.25),
    altitude=Curve(3e3, 50.0, -3.0, 20.0, 0.3),
    roll=Curve(0.0, 1.0, 0.0, 2.0, 0.4),
    pitch=Curve(0.1, 0.0, 0.0, 0.9, 0.3),
    heading=Curve(0.0, 0.3, 0.0, 1.0, 0.2),
)
"""47 g while turning at up to 390 deg/s about all axes."""

SPIN = Flight(
    latitude=Curve(0.8, 5e-5),
    altitude=Curve(1e3, 200.0, -9.0),
    roll=Curve(0.0, 17.45),
    pitch=Curve(0.5, -0.01),
)
"""A ballistic body that rolls at 1000 deg/s; the lift is almost nothing."""

AT_REST = Flight(heading=Curve(0.7))
