"""Variances beside a few columns more: begun from what is known without them, the same as from the rows."""

from __future__ import annotations

import numpy as np
import pytest

from planner.solvers.random_effects import RandomEffects
from planner.solvers.reml_beside import Grounds, reml_roughly
from planner.solvers.restricted_likelihood import Sample, loglik, restricted_loglik

G, M = 30, 12  # groups, rows of each
STARTS = np.arange(0, G * M, M)
START = np.array([0.7, 0.2, 1.5, 0.1])


def rows(seed: int, more: int) -> tuple[Sample, Sample, np.ndarray]:
    """A sample, the same with orthonormal columns more, these; noise that grows, levels, slopes."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=G * M)
    group = np.repeat(np.arange(G), M)
    effects = RandomEffects(STARTS, np.array([np.ones(G * M), u**2]), np.array([np.ones(G * M), u]))
    level, slope = rng.normal(size=(2, G))
    y = np.hypot(0.8, 0.4 * u) * rng.normal(size=G * M) + level[group] + 0.3 * slope[group] * u
    q, _ = np.linalg.qr(rng.normal(size=(G * M, 5 + more)))
    y += 3.0 * q[:, 5]  # hides in the first of the columns more
    without = Sample(y, q[:, :5], effects, True)
    return without, Sample(y, q, effects, True), q[:, 5:]


@pytest.mark.parametrize("more", [1, 4])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_search_begun_beside_columns_more_is_that_of_their_rows(seed: int, more: int) -> None:
    without, whole, columns = rows(seed, more)
    first = Grounds(without, START).with_columns(columns)
    found = reml_roughly(whole, START, 1e-9, first)
    wanted = reml_roughly(whole, START, 1e-9)
    np.testing.assert_allclose(found.theta, wanted.theta, rtol=1e-6, atol=1e-9)
    assert found.of_the_rows == pytest.approx(wanted.of_the_rows, abs=1e-8)
    assert found.of_the_rows == pytest.approx(loglik(whole, found.theta), abs=1e-8)
    assert found.loglik == pytest.approx(restricted_loglik(whole, found.theta), abs=1e-8)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_slope_at_the_start_is_that_of_differences(seed: int) -> None:
    """Score and likelihood at one θ, by V written out; in the units of the search."""
    without, whole, columns = rows(seed, 3)
    first = Grounds(without, START).with_columns(columns)
    assert first is not None
    own = Grounds(whole, START)._state  # in the same units: of the start and of the parts' sizes
    assert first.loglik == pytest.approx(own.loglik, abs=1e-9)
    size = without.effects.mean_sizes()
    total = float(np.sum(START * size))

    def restricted(theta: np.ndarray) -> float:
        return loglik(whole, theta) - 0.5 * np.linalg.slogdet(_information(whole, theta))[1]

    for k in range(4):
        step = 1e-5 * START[k] * np.eye(4)[k]
        slope = (restricted(START + step) - restricted(START - step)) / (2.0 * step[k])
        assert first.score[k] == pytest.approx(slope * total / size[k], rel=1e-5, abs=1e-6)


def _information(sample: Sample, theta: np.ndarray) -> np.ndarray:
    """(r, r) XᵀV⁻¹X, from V written out."""
    e, V = sample.effects, np.zeros((G * M, G * M))
    for k in range(e.count):
        V += theta[k] * e.times(k, np.eye(G * M))
    return sample.basis.T @ np.linalg.solve(V, sample.basis)


def test_columns_that_are_there_already_have_no_slope_of_their_own() -> None:
    without, _, _ = rows(1, 1)
    assert Grounds(without, START).with_columns(without.basis[:, :1]) is None
