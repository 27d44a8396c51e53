"""A quadratic with a kink somewhere: an electronic part that changes its behaviour at one temperature."""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array
from planner.simulate.curves.grid import POINTS, Shape, Single, lattice, places


class Kink(Shape):
    """f(x) = a (x − ½)² + b |x − k|, a and b N(0, 1), k uniform from 0 to 1."""

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, POINTS) independent curves."""
        a, b = rng.normal(size=(2, count, 1))
        k = rng.uniform(size=(count, 1))
        return np.asarray(a * (places() - 0.5) ** 2 + b * np.abs(places() - k))

    def evenly(self, count: int, rng: np.random.Generator) -> Single:
        """(count, POINTS) with the ratio of a to b and k evenly over their law."""
        angle, k = lattice(count, rng)
        a, b = rng.rayleigh(size=count) * np.stack([np.cos(2.0 * np.pi * angle), np.sin(2.0 * np.pi * angle)])
        x, (a, b, k) = places().astype(np.float32), np.array([a, b, k], dtype=np.float32)
        return np.asarray(a[:, None] * (x - 0.5) ** 2 + b[:, None] * np.abs(x - k[:, None]))

    def rows(self) -> Array:
        """(r, POINTS): Gauss-Legendre's two places of k a cell are exact, the kinks lie on the grid."""
        x, half = places(), 0.5 / (POINTS - 1)
        middle = x[:-1] + half
        k = np.concatenate([middle - half / np.sqrt(3.0), middle + half / np.sqrt(3.0)])
        return np.vstack([(x - 0.5) ** 2, np.abs(x - k[:, None]) / np.sqrt(len(k))])
