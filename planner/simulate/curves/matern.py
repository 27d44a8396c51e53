"""A Gaussian process of Matérn's covariance, once differentiable: rough, without a form of its own.

Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), equation 4.17, ν = 3/2.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from planner.nouns.array import Array
from planner.simulate.curves.grid import POINTS, Shape, Single, places

LENGTH = 0.5  # in x


class Matern(Shape):
    """E f(x) f(x') = (1 + √3 d/l) exp(−√3 d/l), d = |x − x'|, l = ½."""

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, POINTS) independent curves."""
        return np.asarray(rng.normal(size=(count, POINTS)) @ _root())

    def evenly(self, count: int, rng: np.random.Generator) -> Single:
        """(count, POINTS) independent curves."""
        each = rng.standard_normal((count, POINTS), dtype=np.float32)
        return np.asarray(each @ _root().astype(np.float32))

    def rows(self) -> Array:
        """(POINTS, POINTS) the covariance's triangular root."""
        return _root()


@cache
def _root() -> Array:
    x = places()
    apart = np.sqrt(3.0) * np.abs(x[:, None] - x) / LENGTH
    return np.asarray(np.linalg.cholesky((1.0 + apart) * np.exp(-apart)).T)
