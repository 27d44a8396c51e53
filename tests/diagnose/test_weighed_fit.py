"""A fit whose rows are weighed by a given covariance is generalised least squares with that matrix."""

from __future__ import annotations

import numpy as np
import pytest

from planner.campaign.channel_model import channel_model
from planner.diagnose.weighed_fit import Spreads, weighed_fit
from planner.dwells.table_rows import by_run
from planner.solvers.random_effects import RandomEffects, covariance
from tests.calibrate.world import Hidden, Layout, campaign

SMALL = Layout(temperatures=(-20.0, 20.0), static_repeats=1, later=(), rate_repeats=1, centrifuge=False)
SIGMA, RUN = 2e-5, 3e-5


@pytest.mark.parametrize("tau", [300.0, 900.0])
def test_it_solves_the_dense_normal_equations_with_its_parameters_held(tau: float) -> None:
    table, starts = by_run(campaign(3, [Hidden("warm_up", "gyro_x", 0.05, tau_s=500.0)], SMALL))
    assert table.gyro is not None
    y, n = table.gyro[:, 0], len(table)
    model = channel_model("gyro", 0, table.conditions(), ("bias", "scale_factor", "misalignment", "warm_up"))
    v = covariance(RandomEffects(starts, np.ones((1, n)), np.ones((1, n))), np.array([SIGMA**2, RUN**2]))
    fit = weighed_fit(
        model, y, v, Spreads(SIGMA, RUN, 0.0), np.zeros(n, dtype=bool), {"warm_up": {"time_constant": tau}}
    )
    same = table.run[:, None] == table.run[None, :]
    weight = np.linalg.inv(SIGMA**2 * np.eye(n) + RUN**2 * same)
    left = fit.J.T @ weight @ fit.residual  # zero at the minimum, whatever the model's products
    size = np.sqrt(np.diag(fit.J.T @ weight @ fit.J))
    assert np.abs(left / size).max() < 1e-3
    k = [c.effect for c in model.columns()].index("warm_up")
    assert fit.J[:, k] == pytest.approx(np.exp(-table.time_on / tau), rel=1e-12)
