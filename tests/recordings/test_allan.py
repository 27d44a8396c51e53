"""Allan deviation: closed forms, the definition written out, terms that come back with their intervals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.recordings.allan import TERMS, NoiseFit, NoiseTerm, allan, best_averaging_time, fit_noise, shapes

RATE = 100.0


def noise(seed: int, white: float, walk: float, count: int = 1 << 16) -> np.ndarray:
    """White noise of density N (unit·√s) and random walk K (unit/√s), sampled at RATE."""
    rng = np.random.default_rng(seed)
    drift = np.cumsum(rng.normal(size=count)) * walk / math.sqrt(RATE)
    return white * math.sqrt(RATE) * rng.normal(size=count) + drift


def overlapping(values: np.ndarray, m: int) -> float:
    """The definition: half the mean square of the difference of neighbouring means over m samples."""
    means = np.convolve(values, np.ones(m) / m, "valid")
    return math.sqrt(0.5 * np.mean((means[m:] - means[:-m]) ** 2))


def test_the_deviation_is_its_definition():
    values = noise(1, 0.01, 0.002, 4096)
    found = allan(values, RATE)
    for tau, deviation in zip(found.tau, found.deviation, strict=True):
        assert deviation == pytest.approx(overlapping(values, round(tau * RATE)), rel=1e-9)


def test_a_ramp_has_its_closed_form():
    found = allan(0.3 * np.arange(10_000) / RATE, RATE)
    np.testing.assert_allclose(found.deviation, 0.3 * found.tau / math.sqrt(2), rtol=1e-6)
    ramp = found.terms[TERMS.index("ramp")]
    assert ramp.value == pytest.approx(0.3, rel=1e-6)
    assert [term.name for term in found.terms if term.seen] == ["ramp"]


def test_quantisation_has_its_closed_form():
    """Rounded angles, differenced: σ²(τ) = 3 Q²/τ² with Q = q/√12."""
    rng = np.random.default_rng(1)
    angle = np.round(rng.uniform(0, 1e4, 1 << 15) / 0.01) * 0.01 - rng.uniform(-0.005, 0.005, 1 << 15)
    error = np.diff(angle - np.round(angle / 0.01) * 0.01) * RATE  # white angle error of spread 0.01/√12
    term = allan(error, RATE).terms[0]
    assert term.low <= 0.01 / math.sqrt(12) <= term.high


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(1e-3, 1e3), min_size=5, max_size=5))
def test_terms_of_an_exact_curve_come_back(squares):
    """A curve that is the model itself is fitted to rounding, at any sizes of its parts."""
    tau = 0.01 * 2.0 ** np.arange(16)
    variance = shapes(tau) @ squares
    terms = fit_noise(tau, np.sqrt(variance), np.full((16, 5), 50.0)).terms
    fitted = shapes(tau) @ np.array([term.value for term in terms]) ** 2
    np.testing.assert_allclose(fitted, variance, rtol=1e-6)


def test_the_intervals_of_white_noise_and_random_walk_hold():
    """95 % intervals over 100 recordings: at least 88 hold, which 95 % would miss once in 400 times."""
    held = np.zeros(2)
    for seed in range(100):
        terms = allan(noise(seed, 0.01, 0.004, 1 << 14), RATE).terms
        for k, (name, truth) in enumerate((("white_noise", 0.01), ("random_walk", 0.004))):
            term = terms[TERMS.index(name)]
            held[k] += term.low <= truth <= term.high
    assert (held >= 88).all(), held


def test_the_chi_square_interval_of_the_deviation_holds():
    """68 % intervals at one τ of white noise over 200 recordings: 136 ± 5 σ of 6.6."""
    held = 0
    for seed in range(200):
        found = allan(np.random.default_rng(seed).normal(size=4096), 1.0)
        held += found.low[6] <= 1 / math.sqrt(found.tau[6]) <= found.high[6]
    assert 103 <= held <= 169


@settings(deadline=None, max_examples=40)
@given(st.floats(0.01, 10), st.floats(0.1, 30))
def test_the_best_time_of_white_noise_and_random_walk(white, best):
    """σ² = N²/τ + K²τ/3 is least at τ = √3 N/K."""
    tau = 0.01 * 2.0 ** np.arange(14)
    walk = math.sqrt(3) * white / best
    terms = tuple(
        NoiseTerm(name, {"white_noise": white, "random_walk": walk}.get(name, 0.0), 0.0, 0.0, True)
        for name in TERMS
    )
    found, at_end = best_averaging_time(tau, NoiseFit(terms, np.ones(14), rises=True))
    assert not at_end
    assert found == pytest.approx(best, rel=0.03)  # 400 points over four decades are 2.3 % apart


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_white_noise_alone_recommends_no_end(seed):
    found = allan(np.random.default_rng(seed).normal(size=1 << 14), RATE)
    assert found.at_end
    assert found.best_time == found.tau[-1]


@settings(deadline=None, max_examples=20)
@given(st.floats(1e-6, 1e6), st.integers(0, 20))
def test_scaling_the_readings_scales_every_term(factor, seed):
    values = noise(seed, 0.01, 0.004, 4096)
    plain, scaled = allan(values, RATE), allan(factor * values, RATE)
    np.testing.assert_allclose(scaled.deviation, factor * plain.deviation, rtol=1e-9)
    np.testing.assert_allclose(
        [t.value for t in scaled.terms],
        factor * np.array([t.value for t in plain.terms]),
        rtol=1e-4,
        atol=1e-9 * factor,
    )


def test_too_few_readings_are_refused():
    with pytest.raises(ValueError, match="too few"):
        allan(np.zeros(63), RATE)
