"""What a variance promises to gain before it is sought, and rows in another order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.solvers.random_effects import Drift, RandomEffects
from planner.solvers.reml import reml, reml_together
from planner.solvers.reml_beside import promised
from planner.solvers.restricted_likelihood import Sample, restricted_loglik

SIZES = np.array([9, 12, 9, 15, 12, 9, 15, 12, 12, 9, 15, 9] * 4)  # of the power-ons, in no order
STARTS = np.concatenate([[0], np.cumsum(SIZES)[:-1]])
N = int(SIZES.sum())
TAU_S = 600.0


def wandering(seed: int, sigma: float) -> tuple[Sample, Drift]:
    """White noise and levels, a bias that wanders within power-ons by so many sigma; that process."""
    rng = np.random.default_rng(seed)
    run = np.repeat(np.arange(len(SIZES)), SIZES)
    time = np.concatenate([np.arange(m) * 100.0 for m in SIZES])
    drift = Drift(np.ones(N), time, TAU_S)
    rho = np.exp(-np.abs(time[:, None] - time) / TAU_S) * (run[:, None] == run)
    walk = np.linalg.cholesky(rho + 1e-9 * np.eye(N)) @ rng.normal(size=N)
    y = rng.normal(size=N) + 0.5 * rng.normal(size=len(SIZES))[run] + sigma * walk
    X, _ = np.linalg.qr(rng.normal(size=(N, 20)))
    return Sample(y, X, RandomEffects(STARTS, np.ones((1, N)), np.ones((1, N))), True), drift


@pytest.mark.parametrize("sigma", [0.0, 0.3, 0.6, 1.5])
@pytest.mark.parametrize("seed", range(4))
def test_a_process_gains_what_its_variance_promises_or_a_few_times_that(seed: int, sigma: float) -> None:
    """The parabola at zero falls short of a process as large as the noise; where it says nothing, none is."""
    sample, drift = wandering(seed, sigma)
    moving = replace(sample, effects=replace(sample.effects, drifts=(drift,)))
    plain = reml_together([sample])
    more = reml_together([moving], np.append(plain.theta, 0.1))
    gain = 2.0 * (restricted_loglik(moving, more.theta) - restricted_loglik(sample, plain.theta))
    promise = float(promised(moving, np.append(plain.theta, 0.0), 1)[0])
    assert promise >= -1e-6
    assert gain <= 4.0 * promise + 0.05
    assert promise <= 4.0 * gain + 0.05


def test_several_variances_promise_each_for_itself() -> None:
    sample, drift = wandering(1, 0.6)
    drifts = [replace(drift, tau=tau) for tau in (100.0, 600.0, 3000.0)]
    theta = reml_together([sample]).theta
    every = replace(sample, effects=replace(sample.effects, drifts=tuple(drifts)))
    together = promised(every, np.append(theta, np.zeros(3)), 3)
    for k, one in enumerate(drifts):
        alone = replace(sample, effects=replace(sample.effects, drifts=(one,)))
        assert promised(alone, np.append(theta, 0.0), 1)[0] == pytest.approx(together[k], rel=1e-9)


@pytest.mark.parametrize("wanders", [False, True])
def test_variances_do_not_hang_on_the_order_of_power_ons(wanders: bool) -> None:
    """Groups of one size are put together for the search; here they are so from the beginning."""
    sample, drift = wandering(2, 1.0)
    e = replace(sample.effects, drifts=(drift,) if wanders else ())
    order = e.order_by_size
    assert order is not None
    sorted_e = e.by_size()
    assert sorted_e.order_by_size is None
    found = reml(sample.y, sample.X, e)
    wanted = reml(sample.y[order], sample.X[order], sorted_e)
    np.testing.assert_allclose(found.theta, wanted.theta, rtol=1e-9)
    np.testing.assert_allclose(found.error, wanted.error, rtol=1e-8)
    assert found.loglik == pytest.approx(wanted.loglik, abs=1e-9)
