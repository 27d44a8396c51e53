"""Rotations: direction cosines, roll-pitch-heading and rotation vectors.

Body axes forward-right-down, navigation axes north-east-down. C_nb turns body components into n components.
Everything is vectorised over leading axes: matrices (..., 3, 3), vectors (..., 3), angles (...) in rad.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def skew(vector: ArrayLike) -> Array:
    """[v×] (..., 3, 3), so that [v×] w = v × w."""
    v = np.asarray(vector, dtype=float)
    matrix = np.zeros((*v.shape, 3))
    matrix[..., 2, 1], matrix[..., 0, 2], matrix[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    matrix[..., 1, 2], matrix[..., 2, 0], matrix[..., 0, 1] = -v[..., 0], -v[..., 1], -v[..., 2]
    return matrix


def cross(a: Array, b: Array) -> Array:
    """a × b over the last axis; several times faster than numpy.cross on small arrays."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )


def rotate(matrix: Array, vector: Array) -> Array:
    """C v for every leading index: (..., 3, 3) and (..., 3) -> (..., 3)."""
    return np.asarray((matrix @ vector[..., None])[..., 0])


def unit(vector: Array) -> Array:
    """The directions (..., 3) of vectors; of none zero."""
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.asarray(np.divide(vector, length, out=np.zeros_like(vector), where=length > 0.0))


def wrapped(angle: Array) -> Array:
    """The same angle (...), rad, in [-π, π)."""
    return np.asarray(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)


def rph_from_dcm(matrix: Array) -> tuple[Array, Array, Array]:
    """Roll, pitch, heading (...) of C_nb (..., 3, 3): roll and heading in (-π, π], pitch in [-π/2, π/2].

    At a pitch of exactly ±π/2 only roll ∓ heading exists; what comes out there is one of the many pairs.
    """
    c = np.asarray(matrix, dtype=float)
    roll = np.arctan2(c[..., 2, 1], c[..., 2, 2])
    pitch = np.arctan2(-c[..., 2, 0], np.hypot(c[..., 2, 1], c[..., 2, 2]))
    heading = np.arctan2(c[..., 1, 0], c[..., 0, 0])
    return roll, pitch, heading


def rotation_vector_from_dcm(matrix: Array) -> Array:
    """The rotation vector (..., 3) of |φ| <= π with exp([φ×]) = C."""
    c = np.asarray(matrix, dtype=float)
    outer = np.empty((*c.shape[:-2], 4, 4))  # 4 q qᵀ; its largest column is the best conditioned quaternion
    outer[..., 1:, 1:] = c + np.swapaxes(c, -1, -2)
    trace = np.trace(c, axis1=-2, axis2=-1)
    outer[..., 0, 0] = 1.0 + trace
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1)), start=1):
        outer[..., i, i] += 1.0 - trace
        outer[..., 0, i] = outer[..., i, 0] = c[..., k, j] - c[..., j, k]
    largest = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(outer, largest[..., None, None], axis=-1)[..., 0]
    q = q * np.where(q[..., :1] < 0.0, -1.0, 1.0) / np.linalg.norm(q, axis=-1, keepdims=True)
    length = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(length, q[..., :1])
    return np.asarray(2.0 * q[..., 1:] / np.where(length == 0.0, 1.0, np.sinc(half / np.pi)))
