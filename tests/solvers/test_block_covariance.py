"""Blocks with processes inside the groups, and REML on them, against dense matrices."""

from __future__ import annotations

import numpy as np
import pytest

from planner.nouns.array import Array
from planner.solvers.random_effects import Drift, RandomEffects, covariance, woodbury
from planner.solvers.reml import reml
from planner.solvers.restricted_likelihood import Sample, restricted_loglik

SIZES = (3, 1, 5, 3, 4, 5, 2, 6)


def effects(seed: int, *, drifting: bool = True) -> RandomEffects:
    rng = np.random.default_rng(seed)
    n = sum(SIZES)
    starts = np.concatenate([[0], np.cumsum(SIZES)[:-1]])
    time = rng.uniform(0.0, 900.0, n)
    drifts = (Drift(np.ones(n), time, 300.0), Drift(rng.normal(size=n), time, 60.0, smooth=True))
    return RandomEffects(
        starts,
        np.stack([rng.uniform(0.5, 2.0, n), rng.uniform(0.0, 1.0, n)]),
        np.stack([np.ones(n), rng.normal(size=n)]),
        drifts if drifting else (),
    )


def parts(e: RandomEffects) -> list[Array]:
    """Every V_k, dense."""
    n = e.rows
    group = np.repeat(np.arange(len(SIZES)), SIZES)
    same = group[:, None] == group[None, :]
    found = [np.diag(d) for d in e.diagonals] + [np.outer(z, z) * same for z in e.slopes]
    for d in e.drifts:
        x = (d.time[:, None] - d.time[None, :]) / d.tau
        rho = np.exp(-(x**2) / 2.0) if d.smooth else np.exp(-np.abs(x))
        found.append(np.outer(d.z, d.z) * rho * same)
    assert all(p.shape == (n, n) for p in found)
    return found


@pytest.mark.parametrize("drifting", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_every_question_is_answered_as_by_dense_matrices(seed: int, drifting: bool) -> None:
    e = effects(seed, drifting=drifting)
    rng = np.random.default_rng(seed + 10)
    theta = rng.uniform(0.1, 3.0, e.count)
    V_k = parts(e)
    V = sum(t * p for t, p in zip(theta, V_k, strict=True))
    inverse = np.linalg.inv(V)
    v = covariance(e, theta)
    A = rng.normal(size=(e.rows, 4))
    np.testing.assert_allclose(v.solve(A), inverse @ A, rtol=1e-8, atol=1e-10)
    white = v.whiten(np.eye(e.rows))
    np.testing.assert_allclose(white @ V @ white.T, np.eye(e.rows), atol=1e-9)
    np.testing.assert_allclose(v.whiten_transposed(A), white.T @ A, rtol=1e-8, atol=1e-10)
    assert v.log_determinant == pytest.approx(np.linalg.slogdet(V)[1], rel=1e-9)
    traces = np.array([[np.trace(inverse @ a @ inverse @ b) for b in V_k] for a in V_k])
    np.testing.assert_allclose(v.double_traces(), traces, rtol=1e-8)
    np.testing.assert_allclose(v.quadratic(A), A.T @ inverse @ A, rtol=1e-8, atol=1e-10)
    within = [np.trace(A.T @ a @ A) for a in V_k]
    np.testing.assert_allclose(v.within(A), within, rtol=1e-8)
    between = [[np.trace(A.T @ (a @ inverse @ b - 0.5 * a @ A @ A.T @ b) @ A) for b in V_k] for a in V_k]
    np.testing.assert_allclose(v.between(A), between, rtol=1e-8)
    np.testing.assert_allclose(v.traces, [np.trace(inverse @ part) for part in V_k], rtol=1e-9)
    np.testing.assert_allclose(e.inner(A), [(A.T @ part @ A).ravel() for part in V_k], rtol=1e-8)
    for k, part in enumerate(V_k):
        np.testing.assert_allclose(e.times(k, A), part @ A, rtol=1e-10, atol=1e-12)


def test_without_processes_blocks_and_small_matrices_agree() -> None:
    from planner.solvers.block_covariance import block_covariance

    e = effects(4, drifting=False)
    theta = np.array([1.0, 0.3, 2.0, 0.7])
    A = np.random.default_rng(0).normal(size=(e.rows, 3))
    np.testing.assert_allclose(block_covariance(e, theta).solve(A), woodbury(e, theta).solve(A), rtol=1e-9)


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("seed", range(6))
def test_reml_arrives_above_the_truth_from_any_start(seed: int, scale: float) -> None:
    """Ten variances over nine decades, most of them hardly told: scoring must not stop on a slope."""
    rng = np.random.default_rng(seed)
    groups, m = 30, 6
    n = groups * m
    time = np.tile(np.arange(m) * 60.0, groups)
    fast = 400.0 * (rng.uniform(size=n) < 0.4) * rng.choice([-1.0, 1.0], n)
    e = RandomEffects(
        np.arange(groups) * m,
        np.stack([np.ones(n), rng.uniform(0.5, 1.5, n)]),
        np.stack([np.ones(n), fast, rng.normal(size=n) * np.abs(fast)]),
        (Drift(np.ones(n), time, 600.0), Drift(fast, time, 600.0)),
    )
    truth = np.array([1.0, 0.0, 4.0, 1e-3, 1e-4, 1.0, 1e-4])
    root = np.linalg.cholesky(_dense(e, truth, groups, m))
    X = np.column_stack([np.ones(n), fast, rng.normal(size=n)])
    y = root @ rng.normal(size=n) * np.sqrt(scale)
    found = reml(y, X, e, start=None if seed % 2 else np.full(7, scale))
    assert restricted_loglik(Sample(y, X, e), found.theta) >= restricted_loglik(
        Sample(y, X, e), scale * truth + 1e-12
    )


def _dense(e: RandomEffects, theta: Array, groups: int, m: int) -> Array:
    group = np.repeat(np.arange(groups), m)
    same = group[:, None] == group[None, :]
    V = np.diag(theta[:2] @ e.diagonals)
    for t, z in zip(theta[2:5], e.slopes, strict=True):
        V = V + t * np.outer(z, z) * same
    for t, d in zip(theta[5:], e.drifts, strict=True):
        V = V + t * np.outer(d.z, d.z) * same * np.exp(-np.abs(d.time[:, None] - d.time[None, :]) / d.tau)
    return V
