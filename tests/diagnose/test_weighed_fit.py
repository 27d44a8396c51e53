"""A fit whose rows are weighed by a given covariance is generalised least squares with that matrix."""

from __future__ import annotations

import numpy as np
import pytest

from planner.campaign.channel_model import channel_model
from planner.diagnose.weighed_fit import Spreads, weighed_fit
from planner.dwells.table_rows import by_run
from planner.solvers.random_effects import RandomEffects, covariance
from tests.calibrate.world import Hidden, Layout, campaign
from tests.diagnose.hall import Noise, read, two_axes

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


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_the_part_of_a_lever_arm_that_no_turn_tells_stays_within_a_lab(seed: int) -> None:
    """By the Earth's rate alone it was 20 km, whose product with a lean left 3.7 m/s² beside 2e-4."""
    hall = two_axes(seed, 4)
    table, starts = by_run(read(hall, seed, acc=Noise(1e-5, 4e-5)))
    assert table.ref_rate is not None
    assert table.acc is not None
    w, arm = table.ref_rate, np.array([2e-4, -2e-4, 1e-4])
    leans = np.eye(3) + np.radians(1.2) * np.random.default_rng([seed, 53]).choice([-1.0, 1.0], (3, 3))
    felt = table.acc + w * (w @ arm)[:, None] - np.sum(w**2, axis=1)[:, None] * arm
    n, white = len(table), 9.80665e-5
    v = covariance(
        RandomEffects(starts, np.ones((1, n)), np.ones((1, n))), np.array([white**2, 16.0 * white**2])
    )
    effects = (
        "bias",
        "bias_temperature",
        "scale_factor",
        "scale_factor_temperature",
        "misalignment",
        "lever_arm",
    )
    for axis in range(3):
        model = channel_model("accelerometer", axis, table.conditions(), effects)
        spreads, none = Spreads(white, 4.0 * white, 0.0), np.zeros(n, dtype=bool)
        fit = weighed_fit(model, 1.03 * (felt @ leans.T)[:, axis], v, spreads, none)
        parts = [x for c, x in zip(model.columns(), fit.theta, strict=True) if c.effect == "lever_arm"]
        assert np.abs(parts).max() < 10.0
        assert np.std(fit.residual) < 10.0 * white
