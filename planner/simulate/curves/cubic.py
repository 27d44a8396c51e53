"""A cubic: what a sensor's own temperature polynomial leaves to be found."""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array
from planner.simulate.curves.grid import Shape, Single, lattice, places


class Cubic(Shape):
    """f = a z + b z² + c z³ with z = 2x − 1; a, b, c N(0, 1)."""

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, POINTS) independent curves."""
        return np.asarray(rng.normal(size=(count, 3)) @ self.rows())

    def evenly(self, count: int, rng: np.random.Generator) -> Single:
        """(count, POINTS) with the direction of (a, b, c) evenly over the sphere."""
        height, angle = lattice(count, rng) * [[2.0], [2.0 * np.pi]] - [[1.0], [0.0]]
        beside = np.sqrt(1.0 - height**2)
        direction = np.stack([height, beside * np.cos(angle), beside * np.sin(angle)], axis=1)
        of_each = np.sqrt(rng.chisquare(3, size=(count, 1))) * direction
        return np.asarray(of_each.astype(np.float32) @ self.rows().astype(np.float32))

    def rows(self) -> Array:
        """(3, POINTS): z, z², z³."""
        z = 2.0 * places() - 1.0
        return np.vstack([z, z**2, z**3])
