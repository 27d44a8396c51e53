"""What a unit's readings answer to its coefficients, y = (1 + κ) v + b with v = u + μ, and the slope of that.

All units and records at once; the coefficients of scale factors act on v, which those of misalignment made.
"""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.verify.declared import Declared, sensed


class Bend:
    """κ v = S(v) k; where S is proportional to v, S(v) = S(1) v once and for all."""

    def __init__(
        self, model: Declared, conditions: Conditions, shape: tuple[int, ...], *, proportional: bool
    ) -> None:
        self.model, self.conditions, self.shape = model, conditions, shape
        self.of_one = self._of(np.ones(shape)) if proportional else None

    def __call__(self, v: Array, k: Array) -> Array:
        """(B, n, c) of v (B, n, c) and coefficients k (B, scale factors)."""
        if k.shape[1] == 0:
            return np.zeros(v.shape)
        return v * times(self.of_one, k) if self.of_one is not None else times(self._of(v), k)

    def columns(self, v: Array) -> Array:
        """(B, n, c, scale factors) S(v)."""
        return v[..., None] * self.of_one if self.of_one is not None else self._of(v)

    def _of(self, v: Array) -> Array:
        found = self.model.scaled(self.conditions, v.reshape(-1, self.shape[2]))
        return found.reshape(*self.shape, -1)


def linearised(
    u: Array, read: Array, B: Array, L: Array, bend: Bend, theta: tuple[Array, Array, Array]
) -> tuple[Array, Array]:
    """What readings leave (B, n c) at coefficients b, k, m, and the response's slope there (B, n c, p)."""
    b, k, m = theta
    v = u + times(L, m)
    bent, h = bend(v, k), 1e-4
    steeper = 1.0 + (bend(v + h, k) - bent) / h
    slope = np.concatenate([B, bend.columns(v), steeper[..., None] * L], axis=3)
    left = read - v - bent - times(B, b)
    return left.reshape(len(left), -1), slope.reshape(len(left), -1, slope.shape[3])


def times(matrix: Array, values: Array) -> Array:
    """(B, n, c, p), (B, p) -> (B, n, c)."""
    units, n, c, p = matrix.shape
    return np.asarray((matrix.reshape(units, n * c, p) @ values[:, :, None]).reshape(units, n, c))


def is_proportional(model: Declared, conditions: Conditions) -> bool:
    """Whether S(v) is v times S(1): then it need be asked once only."""
    if not model.scale:
        return True
    u = sensed(model.sensor, conditions)[:, list(model.channels)]
    one = model.scaled(conditions, np.ones(u.shape))
    return all(
        np.allclose(model.scaled(conditions, v), v[:, :, None] * one, rtol=1e-12, atol=0.0)
        for v in (u, -2.0 * u, 0.5 * np.ones(u.shape))
    )
