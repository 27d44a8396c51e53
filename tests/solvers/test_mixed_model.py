from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import t as student

from planner.solvers.least_squares import least_squares
from planner.solvers.mixed_model import mixed_fit
from planner.solvers.random_effects import RandomEffects, covariance
from planner.solvers.reml import Variances, reml, reml_together
from planner.solvers.restricted_likelihood import Sample, restricted_loglik

# ---------------------------------------------------------------- NIST StRD, linear least squares

# https://www.itl.nist.gov/div898/strd/lls/data/Longley.shtml: employment, then six regressors
LONGLEY = np.loadtxt(
    io.StringIO(
        """60323 83.0 234289 2356 1590 107608 1947  61122 88.5 259426 2325 1456 108632 1948
    60171 88.2 258054 3682 1616 109773 1949  61187 89.5 284599 3351 1650 110929 1950
    63221 96.2 328975 2099 3099 112075 1951  63639 98.1 346999 1932 3594 113270 1952
    64989 99.0 365385 1870 3547 115094 1953  63761 100.0 363112 3578 3350 116219 1954
    66019 101.2 397469 2904 3048 117388 1955  67857 104.6 419180 2822 2857 118734 1956
    68169 108.4 442769 2936 2798 120445 1957  66513 110.8 444546 4681 2637 121950 1958
    68655 112.6 482704 3813 2552 123366 1959  69564 114.2 502601 3931 2514 125368 1960
    69331 115.7 518173 4806 2572 127852 1961  70551 116.9 554894 4007 2827 130081 1962""".replace("  ", "\n")
    )
).reshape(16, 7)
LONGLEY_CERTIFIED = np.array(
    [
        -3482258.63459582,
        15.0618722713733,
        -0.358191792925910e-01,
        -2.02022980381683,
        -1.03322686717359,
        -0.511041056535807e-01,
        1829.15146461355,
    ]
)
LONGLEY_ERRORS = np.array(
    [
        890420.383607373,
        84.9149257747669,
        0.334910077722432e-01,
        0.488399681651699,
        0.214274163161675,
        0.226073200069370,
        455.478499142212,
    ]
)


def digits(found: np.ndarray, certified: np.ndarray) -> float:
    """Correct digits of the worst coefficient."""
    return float(-np.log10(np.max(np.abs(found - certified) / np.abs(certified)) + 1e-16))


def longley() -> tuple[np.ndarray, np.ndarray]:
    return np.column_stack([np.ones(16), LONGLEY[:, 1:]]), LONGLEY[:, 0]


def test_longley_to_nine_digits() -> None:
    beta, _ = least_squares(*longley())
    assert digits(beta, LONGLEY_CERTIFIED) >= 9


def test_longley_errors_and_degrees_of_freedom_through_the_mixed_model() -> None:
    X, y = longley()
    white = RandomEffects(np.arange(16), np.ones((1, 16)), np.empty((0, 16)))
    fit = mixed_fit(y, X, white, reml(y, X, white))
    assert digits(fit.coefficients, LONGLEY_CERTIFIED) >= 9
    # REML stops when the likelihood stands still to 1e-7: the variance is then right to four digits
    np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), LONGLEY_ERRORS, rtol=1e-4)
    np.testing.assert_allclose(fit.freedom, 16 - 7, rtol=1e-3)


@pytest.mark.parametrize("ratio", [1.0, 0.1], ids=["Wampler1", "Wampler2"])
def test_wampler_polynomials_to_eight_digits(ratio: float) -> None:
    x = np.arange(21.0)
    X = x[:, None] ** np.arange(6)
    certified = ratio ** np.arange(6.0)
    beta, _ = least_squares(X, X @ certified)
    assert digits(beta, certified) >= 8


# ---------------------------------------------------------------- against dense matrices and closed forms


def effects_of(rng: np.random.Generator, runs: int, rows: int) -> RandomEffects:
    n = runs * rows
    return RandomEffects(
        np.arange(0, n, rows),
        np.array([np.ones(n), rng.uniform(0.0, 2.0, n)]),
        np.array([np.ones(n), rng.normal(size=n)]),
    )


def dense(effects: RandomEffects, theta: np.ndarray) -> np.ndarray:
    n = effects.diagonals.shape[1]
    return sum(t * effects.times(k, np.eye(n)) for k, t in enumerate(theta))


@given(seed=st.integers(0, 10_000), runs=st.integers(1, 6), rows=st.integers(1, 6))
@settings(deadline=None, max_examples=25)
def test_the_factored_covariance_is_the_dense_one(seed: int, runs: int, rows: int) -> None:
    rng = np.random.default_rng(seed)
    effects, theta = effects_of(rng, runs, rows), rng.uniform(0.1, 3.0, 4)
    v, V = covariance(effects, theta), dense(effects, theta)
    n = runs * rows
    root = v.whiten(np.eye(n))
    np.testing.assert_allclose(v.solve(np.eye(n)) @ V, np.eye(n), atol=1e-9)
    np.testing.assert_allclose(root @ V @ root.T, np.eye(n), atol=1e-9)
    np.testing.assert_allclose(v.whiten_transposed(np.eye(n)), root.T, atol=1e-9)
    np.testing.assert_allclose(v.log_determinant, np.linalg.slogdet(V)[1], atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_samples_that_share_their_variances_are_one_sample_with_coefficients_of_their_own(seed: int) -> None:
    rng = np.random.default_rng(seed)
    parts = [effects_of(rng, 8, 5) for _ in range(2)]
    y, X = rng.normal(size=(2, 40)), rng.normal(size=(2, 40, 3))
    both = RandomEffects(
        np.concatenate([parts[0].starts, parts[1].starts + 40]),
        np.concatenate([p.diagonals for p in parts], axis=1),
        np.concatenate([p.slopes for p in parts], axis=1),
    )
    stacked = np.zeros((80, 6))
    stacked[:40, :3], stacked[40:, 3:] = X
    together = reml_together([Sample(y[i], X[i], parts[i]) for i in range(2)])
    one = reml(y.ravel(), stacked, both)
    # the scales of the two problems differ by rounding only, so they stop within the same tolerance
    np.testing.assert_allclose(together.theta, one.theta, rtol=1e-3, atol=1e-4)
    log = sum(restricted_loglik(Sample(y[i], X[i], parts[i]), together.theta) for i in range(2))
    np.testing.assert_allclose(log, restricted_loglik(Sample(y.ravel(), stacked, both), together.theta))


@pytest.mark.parametrize("seed", range(3))
def test_generalised_least_squares_is_the_textbook_formula(seed: int) -> None:
    rng = np.random.default_rng(seed)
    effects, theta = effects_of(rng, 5, 4), np.array([1.0, 0.3, 2.0, 0.5])
    X, y = rng.normal(size=(20, 3)), rng.normal(size=20)
    W = np.linalg.inv(dense(effects, theta))
    expected = np.linalg.solve(X.T @ W @ X, X.T @ W @ y)
    fit = mixed_fit(y, X, effects, Variances(theta, np.zeros((4, 4)), theta > 0, 0.0, True))
    np.testing.assert_allclose(fit.coefficients, expected, rtol=1e-9)
    np.testing.assert_allclose(fit.covariance, np.linalg.inv(X.T @ W @ X), rtol=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_reml_of_a_balanced_design_is_the_analysis_of_variance(seed: int) -> None:
    """Balanced one-way: σ² = MSW, σ_b² = (MSB − MSW)/k when that is positive (Searle 1992, 4.5)."""
    rng = np.random.default_rng(seed)
    g, k = 12, 5
    y = np.repeat(rng.normal(size=g) * 2.0, k) + rng.normal(size=g * k)
    effects = RandomEffects(np.arange(0, g * k, k), np.ones((1, g * k)), np.ones((1, g * k)))
    found = reml(y, np.ones((g * k, 1)), effects)
    table = y.reshape(g, k)
    within = np.sum((table - table.mean(axis=1, keepdims=True)) ** 2) / (g * (k - 1))
    between = k * np.var(table.mean(axis=1), ddof=1)
    np.testing.assert_allclose(found.theta, [within, (between - within) / k], rtol=1e-3)
    fit = mixed_fit(y, np.ones((g * k, 1)), effects, found)
    np.testing.assert_allclose(fit.covariance[0, 0], between / (g * k), rtol=1e-3)
    np.testing.assert_allclose(fit.freedom, g - 1, rtol=0.01)


def test_a_spread_below_zero_is_held_at_zero() -> None:
    y = np.tile([-1.0, 1.0, 0.5, -0.5], 6)  # runs agree far better than rows: the ANOVA estimate is negative
    effects = RandomEffects(np.arange(0, 24, 4), np.ones((1, 24)), np.ones((1, 24)))
    found = reml(y, np.ones((24, 1)), effects)
    assert found.theta[1] == 0.0
    assert not found.free[1]
    np.testing.assert_allclose(found.theta[0], np.var(y, ddof=1), rtol=1e-6)


@given(seed=st.integers(0, 10_000), scale=st.floats(1e-6, 1e6))
@settings(deadline=None, max_examples=15)
def test_units_change_nothing_but_units(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    effects = effects_of(rng, 8, 4)
    X, y = rng.normal(size=(32, 3)), rng.normal(size=32) + np.repeat(rng.normal(size=8), 4)
    one, other = reml(y, X, effects), reml(scale * y, X, effects)
    # both stop where the likelihood is flat to 1e-7, which leaves the variances 1e-3 of their size
    np.testing.assert_allclose(other.theta, scale**2 * one.theta, rtol=5e-3, atol=1e-4 * scale**2)


def test_what_the_design_does_not_see_is_named() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 30))
    X = np.column_stack([a, b, a + b, np.zeros(30), np.ones(30)])
    _, found = least_squares(X, rng.normal(size=30))
    assert found.rank == 3
    assert found.undetermined().tolist() == [True, True, True, True, False]


def test_no_degree_of_freedom_is_refused() -> None:
    effects = RandomEffects(np.arange(3), np.ones((1, 3)), np.empty((0, 3)))
    with pytest.raises(ValueError, match="nothing is left"):
        reml(np.arange(3.0), np.eye(3), effects)


@pytest.mark.parametrize("spread", [0.0, 3.0])
@pytest.mark.further("spread", [0.5])
def test_intervals_cover_with_few_runs(spread: float) -> None:
    """95 % ± 2 over 200 campaigns of nine runs, three at each of three temperatures.

    The share of 800 intervals is known to 0.8 %, one sigma; intervals by the normal quantile hold 90 %.
    """
    rows = 6
    X = np.zeros((54, 4))
    X[np.arange(54), np.repeat([0, 1, 2], 18)] = 1.0
    X[:, 3] = np.tile([1.0, -1.0, 0, 0, 0, 0], 9)
    effects = RandomEffects(np.arange(0, 54, rows), np.ones((1, 54)), np.ones((1, 54)))
    hits = 0
    for seed in range(200):
        rng = np.random.default_rng([7, seed])
        y = rng.normal(size=54) + spread * np.repeat(rng.normal(size=9), rows)
        fit = mixed_fit(y, X, effects, reml(y, X, effects))
        half = student.ppf(0.975, fit.freedom) * np.sqrt(np.diag(fit.covariance))
        hits += int(np.sum(np.abs(fit.coefficients) <= half))
    assert 0.93 <= hits / 800 <= 0.97
