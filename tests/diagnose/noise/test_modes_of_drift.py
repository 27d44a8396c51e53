"""Modes of what wanders within power-ons make up its covariance, and those left out are as small as said."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.noise.modes_of_drift import MOST_ROWS, modes_of
from planner.solvers.random_effects import Drift

SIZES = (3, 7, 12)


def drift(seed: int) -> Drift:
    rng, n = np.random.default_rng(seed), sum(SIZES)
    return Drift(rng.normal(size=n), np.sort(rng.uniform(0.0, 3000.0, n)), 600.0)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("some", [(0, 1, 2), (1,), ()])
def test_they_make_up_the_covariance(seed: int, some: tuple[int, ...]) -> None:
    one, every = drift(seed), np.split(np.arange(sum(SIZES)), np.cumsum(SIZES)[:-1])
    expected = np.zeros((sum(SIZES), sum(SIZES)))
    for i in some:
        z, t = one.z[every[i]], one.time[every[i]]
        expected[np.ix_(every[i], every[i])] = np.outer(z, z) * np.exp(-np.abs(t[:, None] - t) / one.tau)
    L = modes_of(one, [every[i] for i in some])
    assert pytest.approx(expected, abs=1e-12) == L @ L.T
    few = modes_of(one, [every[i] for i in some], 1e-2)
    assert few.shape[1] <= L.shape[1]
    assert np.abs(few @ few.T - expected).max() <= sum(SIZES) * 1e-2 * max(np.trace(expected), 1e-300)


def test_a_power_on_of_many_rows_has_none() -> None:
    n = MOST_ROWS + 1
    assert modes_of(Drift(np.ones(n), np.arange(n), 600.0), [np.arange(n)]).shape == (n, 0)
