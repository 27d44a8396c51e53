"""A cubic: what a sensor's own temperature polynomial leaves to be found."""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array
from planner.simulate.curves.grid import places


class Cubic:
    """f = a z + b z² + c z³ with z = 2x − 1; a, b, c N(0, 1)."""

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, POINTS) independent curves."""
        return np.asarray(rng.normal(size=(count, 3)) @ self.rows())

    def rows(self) -> Array:
        """(3, POINTS): z, z², z³."""
        z = 2.0 * places() - 1.0
        return np.vstack([z, z**2, z**3])
