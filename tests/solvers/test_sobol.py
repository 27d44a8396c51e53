"""Points of Sobol sequences against those of scipy.stats.qmc, of the same seed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats.qmc import Sobol

from planner.solvers.sobol import sobol


@pytest.mark.parametrize(("dimensions", "bits"), [(1, 0), (1, 9), (2, 1), (7, 12), (52, 10), (53, 3)])
@pytest.mark.parametrize("seed", [0, 7])
def test_points_are_those_of_scipy(dimensions: int, bits: int, seed: int) -> None:
    """Bit by bit: what a plan says does not depend on who draws. Beyond the table scipy draws itself."""
    found = sobol(dimensions, bits, seed)
    np.testing.assert_array_equal(found, Sobol(dimensions, seed=seed).random_base2(bits))
