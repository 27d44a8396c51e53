"""The Earth as navigation sees it: WGS-84 ellipsoid, normal gravity, rotation, and the frames between.

Frames: e is Earth-centred Earth-fixed (ECEF: z to the north pole, x to latitude 0, longitude 0), n is the
local north-east-down frame, i is inertial and coincides with e at time zero. Everything is vectorised over
leading axes: latitude, longitude (rad) and altitude (m) have any common shape (...), vectors are (..., 3).

Sources: NIMA TR8350.2, "Department of Defense World Geodetic System 1984", 3rd edition (2000), and
P. D. Groves, "Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems", 2nd edition.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Scalars = Array | float  # one number per leading index

SEMI_MAJOR_AXIS_M = 6378137.0  # TR8350.2 table 3.1
FLATTENING = 1.0 / 298.257223563  # TR8350.2 table 3.1
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
SEMI_MINOR_AXIS_M = SEMI_MAJOR_AXIS_M * (1.0 - FLATTENING)
EARTH_RATE_RADPS = 7.292115e-5  # TR8350.2 table 3.1
GRAVITY_EQUATOR_MPS2 = 9.7803253359  # TR8350.2 table 3.4
GRAVITY_POLE_MPS2 = 9.8321849378  # TR8350.2 table 3.4
_SOMIGLIANA = (1.0 - FLATTENING) * GRAVITY_POLE_MPS2 / GRAVITY_EQUATOR_MPS2 - 1.0


def principal_radii(latitude: Scalars) -> tuple[Array, Array]:
    """Radii of curvature of the ellipsoid along the meridian and along the prime vertical, R_N and R_E in m.

        R_E = a / (1 - e² sin²φ)^(1/2),   R_N = R_E (1 - e²) / (1 - e² sin²φ)        (Groves 2.105, 2.106)

    At altitude h a step north is (R_N + h) dφ and a step east (R_E + h) cosφ dλ.
    """
    x = 1.0 - ECCENTRICITY_SQUARED * np.sin(latitude) ** 2
    transverse = SEMI_MAJOR_AXIS_M / np.sqrt(x)
    return transverse * (1.0 - ECCENTRICITY_SQUARED) / x, transverse


def gravity(latitude: Scalars, altitude: Scalars) -> Array:
    """Magnitude of normal gravity in m/s², centrifugal acceleration included; it points along local down.

        g(φ, h) = g_E (1 + k sin²φ) / (1 - e² sin²φ)^(1/2) · (1 - 2 h / a)      (Somigliana; TR8350.2 eq 4-1)

    The free-air gradient is the spherical first-order one, the convention of many strapdown programs
    (python-ins among them), so that error growth can be compared figure by figure. Against the second-order
    formula of TR8350.2 (eq 4-3) the gradient differs by less than 0.7 % near the ground, that is by less than
    0.07 % of any position error after 600 s.
    """
    return _gravity(np.asarray(np.sin(latitude) ** 2), altitude)


def _gravity(sin2: Array, altitude: Scalars) -> Array:
    """The same by sin²φ."""
    surface = GRAVITY_EQUATOR_MPS2 * (1.0 + _SOMIGLIANA * sin2) / np.sqrt(1.0 - ECCENTRICITY_SQUARED * sin2)
    return np.asarray(surface * (1.0 - 2.0 * np.asarray(altitude, dtype=float) / SEMI_MAJOR_AXIS_M))


def gravity_ned(latitude: Scalars, altitude: Scalars) -> Array:
    """Normal gravity as a vector (..., 3) north, east, down in m/s²: (0, 0, g)."""
    g = gravity(latitude, altitude)
    return np.stack([np.zeros_like(g), np.zeros_like(g), g], axis=-1)


def gravitation(position: Array) -> Array:
    """The Earth's attraction alone (..., 3), m/s²: gravity less its centrifugal part, γ = g - Ω² (x, y, 0).

    position: (..., 3) m in any axes whose z is the Earth's axis, e or i alike; the result is in the same.
    Flights ask for it at every step, so directions are taken by their sines and cosines, without an angle.
    """
    x, y, z = position[..., 0], position[..., 1], position[..., 2]
    distance = np.hypot(x, y)
    sin, cos, altitude = _geodetic(distance, z)
    g = _gravity(sin * sin, altitude)
    outwards = EARTH_RATE_RADPS**2 + g * cos / np.where(distance > 0.0, distance, 1.0)
    return np.stack([-outwards * x, -outwards * y, -g * sin], axis=-1)


def earth_rate_ned(latitude: Scalars) -> Array:
    """Rotation of the Earth, ω_ie^n = Ω (cosφ, 0, -sinφ), (..., 3) rad/s north-east-down (Groves 2.123)."""
    phi = np.asarray(latitude, dtype=float)
    return EARTH_RATE_RADPS * np.stack([np.cos(phi), np.zeros_like(phi), -np.sin(phi)], axis=-1)


def transport_rate_ned(latitude: Scalars, altitude: Scalars, velocity: Array) -> Array:
    """Rotation of the local frame over the Earth, ω_en^n, (..., 3) rad/s; velocity (..., 3) NED in m/s.

    ω_en^n = (v_E / (R_E + h), -v_N / (R_N + h), -v_E tanφ / (R_E + h))                    (Groves 5.44)
    """
    v = np.asarray(velocity, dtype=float)
    meridian, transverse = principal_radii(latitude)
    north = v[..., 1] / (transverse + altitude)
    east = -v[..., 0] / (meridian + altitude)
    return np.stack(np.broadcast_arrays(north, east, -north * np.tan(latitude)), axis=-1)


def lla_to_ecef(latitude: Scalars, longitude: Scalars, altitude: Scalars) -> Array:
    """Position (..., 3) in the e frame, m (Groves 2.112)."""
    _, transverse = principal_radii(latitude)
    distance = (transverse + altitude) * np.cos(latitude)
    z = ((1.0 - ECCENTRICITY_SQUARED) * transverse + altitude) * np.sin(latitude)
    return np.stack(
        np.broadcast_arrays(distance * np.cos(longitude), distance * np.sin(longitude), z), axis=-1
    )


def ecef_to_lla(position: Array) -> tuple[Array, Array, Array]:
    """Latitude, longitude (rad) and altitude (m) of a position (..., 3) in the e frame.

    Bowring's formula, applied twice: below 1e-9 m from the ground to 1000 km. Not for the Earth's centre.
    Source: B. R. Bowring, "Transformation from spatial to geographical coordinates", Survey Review 23 (1976).
    """
    r = np.asarray(position, dtype=float)
    sin, cos, altitude = _geodetic(np.hypot(r[..., 0], r[..., 1]), r[..., 2])
    return np.arctan2(sin, cos), np.arctan2(r[..., 1], r[..., 0]), altitude


def _geodetic(distance: Array, z: Array) -> tuple[Array, Array, Array]:
    """Sine and cosine of the latitude, and altitude; distance: from the Earth's axis, m."""
    sin, cos = _direction(z, distance * (1.0 - FLATTENING))  # of the reduced latitude
    sin, cos = _bowring(sin, cos, distance, z)
    sin, cos = _direction((1.0 - FLATTENING) * sin, cos)
    sin, cos = _bowring(sin, cos, distance, z)
    surface = SEMI_MAJOR_AXIS_M * np.sqrt(1.0 - ECCENTRICITY_SQUARED * sin * sin)
    return sin, cos, np.asarray(distance * cos + z * sin - surface)


def _bowring(sin: Array, cos: Array, distance: Array, z: Array) -> tuple[Array, Array]:
    """Sine and cosine of the latitude by those of a reduced one."""
    second = ECCENTRICITY_SQUARED / (1.0 - ECCENTRICITY_SQUARED)
    return _direction(
        z + second * SEMI_MINOR_AXIS_M * sin * sin * sin,
        distance - ECCENTRICITY_SQUARED * SEMI_MAJOR_AXIS_M * cos * cos * cos,
    )


def _direction(up: Array, out: Array) -> tuple[Array, Array]:
    """Sine and cosine of the angle whose tangent is up / out."""
    length = np.hypot(up, out)
    return np.asarray(up / length), np.asarray(out / length)


def ecef_from_ned(latitude: Scalars, longitude: Scalars) -> Array:
    """C_en (..., 3, 3): turns north-east-down components into e components; its columns are the n axes."""
    phi, lam = np.broadcast_arrays(np.asarray(latitude, dtype=float), np.asarray(longitude, dtype=float))
    sin_phi, cos_phi, sin_lam, cos_lam = np.sin(phi), np.cos(phi), np.sin(lam), np.cos(lam)
    matrix = np.empty((*phi.shape, 3, 3))
    matrix[..., 0, 0], matrix[..., 1, 0], matrix[..., 2, 0] = -sin_phi * cos_lam, -sin_phi * sin_lam, cos_phi
    matrix[..., 0, 1], matrix[..., 1, 1], matrix[..., 2, 1] = -sin_lam, cos_lam, 0.0
    matrix[..., 0, 2], matrix[..., 1, 2], matrix[..., 2, 2] = -cos_phi * cos_lam, -cos_phi * sin_lam, -sin_phi
    return matrix


def ned_from_ecef(latitude: Scalars, longitude: Scalars) -> Array:
    """C_ne (..., 3, 3): turns e components into north-east-down ones; the transpose of `ecef_from_ned`."""
    return np.swapaxes(ecef_from_ned(latitude, longitude), -1, -2)


def inertial_from_ecef(time_s: Scalars) -> Array:
    """C_ie (..., 3, 3) at `time_s` seconds after the frames coincided: a turn by Ω t about z."""
    angle = EARTH_RATE_RADPS * np.asarray(time_s, dtype=float)
    matrix = np.zeros((*angle.shape, 3, 3))
    matrix[..., 0, 0] = matrix[..., 1, 1] = np.cos(angle)
    matrix[..., 1, 0] = np.sin(angle)
    matrix[..., 0, 1] = -matrix[..., 1, 0]
    matrix[..., 2, 2] = 1.0
    return matrix
