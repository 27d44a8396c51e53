"""Kriging weights against their definition."""

from __future__ import annotations

import numpy as np
import pytest

from planner.nouns.array import Array
from planner.solvers.kriging import kriging_weights
from planner.temperature_table import hats

SEEDS = (1, 2, 3, 4)


def case(seed: int, K: int = 5, X: int = 7) -> tuple[Array, Array, Array, Array, Array]:
    """Nodes, places; M of both together from few random smooth curves; C of the nodes."""
    rng = np.random.default_rng(seed)
    nodes, read = np.sort(rng.uniform(-60.0, 60.0, K)), rng.uniform(-70.0, 70.0, X)
    t = np.concatenate([nodes, read]) / 60.0
    curves = rng.normal(size=(40, 8)) @ np.array([np.cos(m * 1.3 * t + m) / m for m in range(1, 9)])
    root = rng.normal(size=(K, K)) * 0.2
    return nodes, read, curves.T @ curves / 40.0, root @ root.T, rng.normal(size=(X, K))


def mean_square(w: Array, M: Array, C: Array) -> Array:
    """(X,) E (w·v − c − f(T))² of weights (X, K) that sum to one."""
    K = w.shape[1]
    across, own = M[:K, K:], np.diag(M)[K:]
    known = M[:K, :K] + C
    return np.asarray(np.einsum("xk,kl,xl->x", w, known, w) - 2.0 * np.sum(w * across.T, axis=1) + own)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_weights_that_keep_a_constant_are_better(seed: int) -> None:
    """Straight lines among them; nor any step away along a direction that sums to zero."""
    nodes, read, M, C, away = case(seed)
    w = kriging_weights(M[:5, :5] + C, M[:5, 5:])
    np.testing.assert_allclose(w.sum(axis=1), 1.0, atol=1e-9)
    least = mean_square(w, M, C)
    assert np.all(least <= mean_square(hats(read, nodes, 5.0), M, C) * (1.0 + 1e-6))
    away = 1e-2 * (away - away.mean(axis=1, keepdims=True))
    for sign in (1.0, -1.0):
        assert np.all(mean_square(w + sign * away, M, C) > least)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_curve_much_larger_than_the_noise_is_interpolated(seed: int) -> None:
    nodes, _, _, C, _ = case(seed)
    large = 1e6 * np.exp(-np.abs(np.subtract.outer(nodes, nodes)) / 40.0)
    np.testing.assert_allclose(kriging_weights(large + C, large), np.eye(5), atol=1e-3)


@pytest.mark.parametrize("seed", SEEDS)
def test_without_a_curve_it_is_the_mean_by_generalised_least_squares(seed: int) -> None:
    _, _, _, C, _ = case(seed)
    flat = np.linalg.solve(C, np.ones(5))
    w = kriging_weights(C, np.zeros((5, 3)))
    np.testing.assert_allclose(w, np.tile(flat / flat.sum(), (3, 1)), rtol=1e-4)


def test_one_node_is_a_constant_and_many_systems_are_solved_at_once() -> None:
    alone = kriging_weights(np.array([[2.0]]), np.array([[1.0, -5.0]]))
    np.testing.assert_allclose(alone, [[1.0], [1.0]], rtol=1e-12)
    each = [case(seed) for seed in SEEDS]
    known = np.array([M[:5, :5] + C for _, _, M, C, _ in each])
    across = np.array([M[:5, 5:] for _, _, M, _, _ in each])
    together = kriging_weights(known, across)
    for w, one, other in zip(together, known, across, strict=True):
        np.testing.assert_allclose(w, kriging_weights(one, other), rtol=1e-9, atol=1e-12)


def test_units_do_not_matter() -> None:
    _, _, M, C, _ = case(1)
    w = kriging_weights(M[:5, :5] + C, M[:5, 5:])
    np.testing.assert_allclose(kriging_weights(1e-12 * (M[:5, :5] + C), 1e-12 * M[:5, 5:]), w, rtol=1e-6)
