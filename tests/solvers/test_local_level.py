"""The augmented filter against the dense covariance of the same model."""

from __future__ import annotations

import numpy as np
import pytest

from planner.solvers.local_level import filtered

WALK, FRESH = 0.3, 5


def _case(seed: int, *, fresh: bool):
    rng = np.random.default_rng(seed)
    day = np.cumsum(rng.uniform(1, 12, 9))
    X = np.stack([day / 60, np.sin(day / 58)], axis=1)
    noise = rng.uniform(0.2, 2.0, 9)
    y = rng.normal(size=9).cumsum()
    begins = np.zeros(9, dtype=bool)
    begins[FRESH] = fresh
    return day, X, noise, y, begins


def _dense(day, X, noise, y, begins, beta):
    """−2 log p of y with every level that starts anew projected out: generalised least squares."""
    V = WALK * np.minimum.outer(day - day[0], day - day[0]) + np.diag(noise)
    levels = [np.ones(len(y))] + [(day >= day[i]).astype(float) for i in np.flatnonzero(begins)]
    U = np.stack(levels, axis=1)
    rest = y - X @ beta
    Vi = np.linalg.inv(V)
    P = Vi - Vi @ U @ np.linalg.solve(U.T @ Vi @ U, U.T @ Vi)
    log = np.linalg.slogdet(V)[1] + np.linalg.slogdet(U.T @ Vi @ U)[1]
    return float(rest @ P @ rest), float(log)


@pytest.mark.parametrize("fresh", [False, True])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_likelihood_is_that_of_the_dense_model(seed, fresh):
    day, X, noise, y, begins = _case(seed, fresh=fresh)
    columns = np.column_stack([y, X])[None]
    found = filtered(
        day[None], columns, noise[None, None], np.ones((1, 9), dtype=bool), begins[None], np.array([WALK])
    )
    for beta in (np.zeros(2), np.array([1.0, -2.0])):
        a = np.append(1.0, -beta)
        quadratic, log = _dense(day, X, noise, y, begins, beta)
        assert a @ found.gram[0, 0] @ a == pytest.approx(quadratic, rel=1e-9)
        if not fresh:  # a jump of the level has a determinant of its own, the same for every beta and size
            assert found.log_f[0, 0] == pytest.approx(log, rel=1e-9)
    assert found.count[0] == 8 - fresh


def test_values_that_are_not_used_are_as_if_they_were_not_there():
    day, X, noise, y, begins = _case(5, fresh=False)
    keep = np.ones(9, dtype=bool)
    keep[[3, 8]] = False
    columns = np.column_stack([y, X])
    walk = np.array([WALK])
    padded = filtered(day[None], columns[None], noise[None, None], keep[None], begins[None], walk)
    short = filtered(
        day[keep][None],
        columns[keep][None],
        noise[keep][None, None],
        keep[keep][None],
        begins[keep][None],
        walk,
    )
    assert padded.gram == pytest.approx(short.gram)
    assert padded.level == pytest.approx(short.level)
    assert padded.variance[0, 0] == pytest.approx(short.variance[0, 0] + WALK * (day[8] - day[7]))
