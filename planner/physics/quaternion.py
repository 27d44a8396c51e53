"""Rotations of many flights at once, components first: vectors (3, ...), unit quaternions (4, ...).

With the components first every line is one pass over contiguous memory; `attitude` has them last. The scalar
component of a quaternion comes first.
"""

from __future__ import annotations

import numpy as np

from planner.physics.attitude import rotation_vector_from_dcm
from planner.physics.earth import Array

_FEW = 1500  # elements, up to which calls take longer than copies
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def cross(a: Array, b: Array) -> Array:
    """a × b, (3, ...)."""
    if max(a.size, b.size) <= _FEW:
        return np.asarray(
            a.take(_NEXT, axis=0) * b.take(_LAST, axis=0) - a.take(_LAST, axis=0) * b.take(_NEXT, axis=0)
        )
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(a[j], b[k], out=result[i, ...])
        result[i] -= a[k] * b[j]
    return result


def from_rotation_vector(theta: Array) -> Array:
    """Unit quaternion (4, ...), scalar first, of rotation vectors (3, ...): (cos θ/2, sin(θ/2)/θ θ)."""
    half = 0.5 * np.sqrt(np.sum(theta * theta, axis=0))
    result = np.empty((4, *half.shape))
    result[0] = np.cos(half)
    result[1:] = 0.5 * np.sinc(half / np.pi) * theta
    return result


def product(p: Array, q: Array) -> Array:
    """Quaternion product: first turn by q, then by p."""
    result = cross(p[1:], q[1:])
    result += p[0] * q[1:]
    result += p[1:] * q[0]
    scalar = p[0] * q[0] - np.sum(p[1:] * q[1:], axis=0)
    return np.concatenate([scalar[None], result])


def rotated(q: Array, v: Array) -> Array:
    """q v q*: v + 2 q₀ (q × v) + 2 q × (q × v)."""
    turned = cross(q[1:], v)
    turned *= 2.0
    return np.asarray(v + q[0] * turned + cross(q[1:], turned))


def to_matrix(q: Array) -> Array:
    """Direction cosines (..., 3, 3) of quaternions (4, ...): C = I + 2/|q|² (q₀ [q×] + [q×]²)."""
    twice = 2.0 / np.sum(q * q, axis=0)
    matrix = np.empty((*q.shape[1:], 3, 3))
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        across = q[1 + j] * q[1 + k]
        along = q[0] * q[1 + i]
        matrix[..., i, i] = 1.0 - twice * (q[1 + j] ** 2 + q[1 + k] ** 2)
        matrix[..., k, j] = twice * (across + along)
        matrix[..., j, k] = twice * (across - along)
    return matrix


def from_matrix(matrix: Array) -> Array:
    """Quaternions (4, ...) of direction cosines (..., 3, 3)."""
    return from_rotation_vector(np.moveaxis(rotation_vector_from_dcm(matrix), -1, 0))
