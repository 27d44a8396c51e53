"""Intervals beside a time constant are where the fit, made anew with it held, has lost t² of its squares."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from planner.calibrate.dwells_to_fit import fit_sensor
from planner.calibrate.fit_to_calibration import CONFIDENCE, coefficients_of
from planner.calibrate.profiled import profiled
from planner.campaign.estimate import Estimate, weighed
from planner.dwells.table_rows import by_run
from planner.measurement import evaluate, jacobian
from planner.solvers.distributions import student_quantile
from tests.diagnose.hall import hidden, read
from tests.diagnose.search.test_settled_later import late
from tests.diagnose.worlds import DECLARED, spec


@cache
def fitted(seed: int) -> Estimate:
    """Gyro x of a unit that settles in 25 s, with records from twenty seconds on, which declares it."""
    hall = late(seed)
    table = hidden(read(hall, seed), "gyro", 0, -0.02 * np.exp(-hall.time_on / 25.0))
    ordered, _ = by_run(table)
    (fit,) = fit_sensor(ordered, "gyro", spec(), effects=(*DECLARED, "settling"), channels=[0])
    return fit


def squares(fit: Estimate, tau: float) -> float:
    """What the fit leaves with the time constant held, by its own steps."""
    m, y = fit.model, fit.residual + evaluate(fit.model, fit.theta).predicted
    theta = np.append(fit.theta[: m.linear], tau)
    for _ in range(3):
        parts = evaluate(m, theta)
        J = jacobian(m, theta, parts)[:, : m.linear]
        target = y - parts.predicted + J @ theta[: m.linear]
        best, _, white = weighed(target, J, fit.prior, fit.noise, fit.variances)
        theta[: m.linear] = best
    return float(white @ white)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4])
def test_the_squares_have_risen_by_t_squared_at_both_ends(seed: int) -> None:
    fit = fitted(seed)
    place = fit.model.linear
    ends = profiled(fit, CONFIDENCE)[place]
    error = np.sqrt(fit.fit.covariance[place, place])
    inflated = error / np.linalg.norm(fit.fit.factors.to_coefficients[place])
    rise = (student_quantile(0.975, fit.fit.freedom[place]) * inflated) ** 2
    for end in ends:
        assert squares(fit, end) - squares(fit, fit.theta[place]) == pytest.approx(rise, rel=0.1)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4])
def test_a_calibration_tells_the_profile_and_is_longer_to_the_side_that_is_told_less(seed: int) -> None:
    fit = fitted(seed)
    told = profiled(fit, CONFIDENCE)
    assert len(told) == 2
    of_settling = {c.term: c for c in coefficients_of(fit, spec()) if c.error.endswith("settling")}
    tau = of_settling["time_constant"]
    assert (np.log(tau.low), np.log(tau.high)) == pytest.approx(told[fit.model.linear])
    assert tau.low < tau.value < tau.high
    size = of_settling["x"]
    assert 0.0 < size.low < size.value < size.high
    assert size.high - size.value > 1.1 * (size.value - size.low)
