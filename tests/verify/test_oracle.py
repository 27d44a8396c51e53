"""The dense oracle itself against what pencil and paper give."""

from __future__ import annotations

import numpy as np
import pytest

from planner.nouns.conditions import Conditions
from tests import oracle


def _rest(temperature, day=0.0, time_on=60.0):
    """Records at rest on the z face."""
    n = len(temperature)
    return Conditions(
        rate=np.zeros((n, 3)),
        specific_force=np.tile([0.0, 0.0, 9.8], (n, 1)),
        temperature_degc=np.asarray(temperature, float),
        temperature_rate=np.zeros(n),
        time_on=np.broadcast_to(np.asarray(time_on, float), n),
        day=np.broadcast_to(np.asarray(day, float), n),
    )


def test_the_mean_of_n_power_ons_has_sigma_over_root_n():
    sizes = {"bias": oracle.Size(run_to_run=lambda t: np.full(np.shape(t), 2.0))}
    c = _rest(np.zeros(8))
    unknowns, A = oracle.columns("gyro", c, sizes)
    V = oracle.covariance("gyro", c, np.arange(8), sizes, np.zeros(8))
    found = oracle.posterior(A, V, *oracle.prior(unknowns, sizes))
    assert np.allclose(found, np.eye(3) * 4.0 / 8)


def test_records_of_one_power_on_share_its_draw():
    sizes = {"bias": oracle.Size(run_to_run=lambda t: np.full(np.shape(t), 2.0))}
    c = _rest(np.zeros(8))
    unknowns, A = oracle.columns("gyro", c, sizes)
    V = oracle.covariance("gyro", c, np.zeros(8), sizes, np.ones(8))
    found = oracle.posterior(A, V, *oracle.prior(unknowns, sizes))
    assert np.allclose(np.diag(found), 4.0 + 1.0 / 8)


def test_a_campaign_of_one_day_does_not_know_the_walk_to_the_flight():
    sizes = {"bias": oracle.Size(run_to_run=np.ones_like, storage=3.0)}
    c = _rest(np.zeros(4))
    unknowns, A = oracle.columns("gyro", c, sizes, flight_day=60.0)
    V = oracle.covariance("gyro", c, np.arange(4), sizes, np.zeros(4))
    found = oracle.posterior(A, V, *oracle.prior(unknowns, sizes))
    x = [i for i, u in enumerate(unknowns) if u.term == "x" and (u.part == "constant" or u.at == 60.0)]
    assert found[np.ix_(x, x)].sum() == pytest.approx(1.0 / 4 + 9.0)


def test_two_nodes_leave_of_a_brownian_curve_what_the_bridge_has():
    """cov f = min(T, T'): between nodes at 0 and 1 the straight line leaves T (1 − T)."""
    grid = np.linspace(0.0, 1.0, 5)
    sizes = {"bias": oracle.Size(grid=grid, kernel=np.minimum.outer(grid, grid))}
    c = _rest([0.0, 1.0])
    unknowns, A = oracle.columns("gyro", c, sizes)
    A = A[0::3]
    V = np.eye(2) * 1e-12
    nodes = np.eye(2)
    x = [u.term == "x" for u in unknowns]
    seen = np.array([[u.part == "constant" or u.at == 0.25 for u in unknowns]]) * np.array(x, float)
    T, precision = oracle.prior(unknowns, sizes)
    found = oracle.posterior_of_lines(A, V, T, precision, nodes, seen, np.array([[0.75, 0.25]]))
    assert found == pytest.approx(np.array([[0.25 * 0.75]]), rel=1e-9)
    with pytest.raises(ValueError, match="constant"):
        oracle.posterior_of_lines(A, V, T, precision, nodes, seen, np.array([[0.75, 0.0]]))


def test_in_run_drift_is_forgotten_with_its_correlation_time():
    sizes = {"bias": oracle.Size(in_run=2.0, in_run_time=100.0)}
    V = oracle.covariance("gyro", _rest([0.0, 0.0], time_on=[0.0, 50.0]), np.zeros(2), sizes, np.zeros(2))
    assert V[0::3, 0::3] == pytest.approx(4.0 * np.array([[1, np.exp(-0.5)], [np.exp(-0.5), 1]]))
