"""What only products of errors tell is not told: the fit looks along no direction that no error alone shows.

Accelerometers at 1 g do not tell a cubic from a scale factor: u³ is u on every face. With the misalignments
that a fit has found the input is 0.005 g where it was none, and cubes of that are something else: a fit that
believes them goes to a cubic of 2738 +- 56 times its unit with a scale factor of −1.1 and misalignments of
half a right angle, which leave as little. To first order, with the errors at zero, nothing of that is seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.measurement import ChannelModel, Parts, evaluate, jacobian
from planner.nouns.array import Array
from planner.solvers.least_squares import factors

UNSEEN = 1e-6  # of the columns' lengths: references to six digits
ROUNDING = 1e-12  # of a column's largest element, or of its length at θ = 0


@dataclass(frozen=True)
class FirstOrder:
    """N (q, k) orthonormal in coefficients times scale (q,), of which no row says anything at θ = 0."""

    scale: Array
    unseen: Array

    def slope(self, model: ChannelModel, theta: Array, parts: Parts) -> Array:
        """J (n, p) at θ without what is along N: J − (J/s) N Nᵀ s; a column that is all of that is none."""
        J = jacobian(model, theta, parts)
        if self.unseen.shape[1]:
            linear = J[:, : model.linear]
            size = ROUNDING * np.maximum(np.abs(linear).max(axis=0), self.scale)
            linear -= (linear / self.scale @ self.unseen) @ (self.unseen.T * self.scale)
            linear[:, np.abs(linear).max(axis=0) <= size] = 0.0
        return J


def first_order(model: ChannelModel) -> FirstOrder:
    """What the linear coefficients of a model do not show one by one; its parameters are not asked."""
    start = model.start()
    found = factors(jacobian(model, start, evaluate(model, start))[:, : model.linear], UNSEEN)
    return FirstOrder(found.scale, found.null_space)
