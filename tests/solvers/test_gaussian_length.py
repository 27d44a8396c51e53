from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, stats

from planner.solvers.gaussian_length import exceedance, length_per_rms, percentile, principal_variances

PROMISED = 1e-9  # the relative accuracy that the docstrings promise
PROBABILITIES = [1e-3, 0.05, 0.5, 0.9, 0.95, 0.997, 1 - 1e-9]


@pytest.mark.parametrize("probability", PROBABILITIES)
@pytest.mark.parametrize("components", [1, 2, 3])
def test_equal_components_follow_the_normal_rayleigh_and_maxwell_laws(components, probability):
    expected = 1.7 * stats.chi(components).ppf(probability)
    found = percentile(1.7**2 * np.eye(components), probability)
    assert found == pytest.approx(expected, rel=PROMISED)


@pytest.mark.parametrize("probability", PROBABILITIES)
@pytest.mark.parametrize("rank", [1, 2])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_degenerate_covariance_in_any_direction_has_the_law_of_its_rank(rank, seed, probability):
    turn = stats.special_ortho_group(3, seed=seed).rvs()
    covariance = 4.0 * turn[:, :rank] @ turn[:, :rank].T
    # rounding leaves eigenvalues of 1e-16 in place of zeros; they add as much to the variance
    assert percentile(covariance, probability) == pytest.approx(
        2.0 * stats.chi(rank).ppf(probability), rel=PROMISED
    )


def test_a_zero_covariance_has_no_length():
    assert percentile(np.zeros((3, 3)), 0.95) == 0.0
    assert exceedance(np.zeros((2, 3, 3)), np.array([0.0, 1.0])).tolist() == [0.0, 0.0]


def by_conditioning(variances: np.ndarray, length: float) -> float:
    """P(‖x‖ > length) by adaptive quadrature over the other two components in Cartesian coordinates.

    Independent of the implementation, which works in polar coordinates: with x₃ = σ₃u and x₂ = σ₂v
    given, the first component must exceed what is left.
    """
    first, second, third = np.sqrt(variances)

    def left(u: float, v: float) -> float:
        rest = np.sqrt(max(length**2 - (third * u) ** 2 - (second * v) ** 2, 0.0))
        return 2.0 * stats.norm.sf(rest / first)

    def given_third(u: float) -> float:
        edge = np.sqrt(max(length**2 - (third * u) ** 2, 0.0)) / second
        inner = integrate.quad(lambda v: left(u, v) * np.exp(-0.5 * v * v), 0.0, edge, epsabs=1e-13)[0]
        return 2.0 * inner / np.sqrt(2.0 * np.pi) + 2.0 * stats.norm.sf(edge)

    end = length / third
    middle = integrate.quad(lambda u: given_third(u) * np.exp(-0.5 * u * u), 0.0, end, epsabs=1e-12)[0]
    return 2.0 * middle / np.sqrt(2.0 * np.pi) + 2.0 * stats.norm.sf(end)


@pytest.mark.parametrize("variances", [(1.0, 0.6, 0.3), (4.0, 1.0, 0.2), (1.0, 0.9, 0.05)])
@pytest.mark.parametrize("length", [0.7, 1.8])
def test_three_unequal_components_agree_with_adaptive_quadrature(variances, length):
    expected = by_conditioning(np.array(variances), length)
    # the nested quadrature itself holds 1e-9: its integrand has a root's kink where the sphere ends
    assert exceedance(np.diag(variances), np.array(length)) == pytest.approx(expected, abs=2e-9)


def in_plane(variances: tuple[float, float], length: float) -> float:
    """P(‖x‖ > length) of two components: mean over the direction of the Rayleigh tail."""

    def tail(angle: float) -> float:
        along = variances[0] * np.cos(angle) ** 2 + variances[1] * np.sin(angle) ** 2
        return float(np.exp(-(length**2) / (2.0 * along)))

    return integrate.quad(tail, 0.0, np.pi / 2, epsabs=0, epsrel=1e-12, limit=400)[0] / (np.pi / 2)


@pytest.mark.parametrize("ratio", [1.0, 0.9, 0.3, 1e-2, 1e-4, 1e-8])
@pytest.mark.parametrize("length", [0.05, 0.7, 2.0, 5.0])
def test_two_components_agree_with_the_mean_of_rayleigh_tails(ratio, length):
    found = exceedance(np.diag([1.0, ratio]), np.array(length))
    assert found == pytest.approx(in_plane((1.0, ratio), length), rel=PROMISED)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("components", [2, 3])
def test_simulated_vectors_stay_below_the_percentile_as_often_as_promised(seed, components):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(components, components)) * 10 ** rng.uniform(-2, 0, components)
    lengths = np.linalg.norm(rng.normal(size=(400_000, components)) @ root, axis=1)
    for probability in (0.2, 0.95):
        share = (lengths < percentile(root.T @ root, probability)).mean()
        # five sigma of the binomial count: one false alarm in two million
        assert abs(share - probability) < 5 * np.sqrt(probability * (1 - probability) / len(lengths))


spectra = st.tuples(*[st.floats(-12, 3).map(lambda power: 10**power)] * 3)


@settings(deadline=None, max_examples=80)
@given(spectra, st.floats(0.01, 0.9999))
def test_the_percentile_inverts_the_distribution(variances, probability):
    length = percentile(np.diag(variances), probability)
    assert exceedance(np.diag(variances), length) == pytest.approx(1 - probability, rel=PROMISED)


@settings(deadline=None, max_examples=80)
@given(spectra, st.floats(0.01, 0.9999), st.floats(1.0, 100.0), st.integers(0, 2))
def test_more_variance_never_shortens_it(variances, probability, factor, which):
    larger = np.array(variances)
    larger[which] *= factor
    before, after = (percentile(np.diag(v), probability) for v in (np.array(variances), larger))
    assert after >= before * (1 - PROMISED)
    # and it stays between one component alone and three equal ones of the largest variance
    assert np.sqrt(larger.max()) * stats.chi(1).ppf(probability) <= after * (1 + PROMISED)
    assert after <= np.sqrt(larger.max()) * stats.chi(3).ppf(probability) * (1 + PROMISED)


@settings(deadline=None, max_examples=60)
@given(spectra, st.sampled_from([0.05, 0.5, 0.8, 0.95, 0.999]))
def test_the_bounds_on_the_percentile_per_rms_hold_for_every_shape(variances, probability):
    least, most = length_per_rms(probability)
    ratio = percentile(np.diag(variances), probability) / np.sqrt(sum(variances))
    assert least <= ratio <= most
    shapes = [percentile(np.eye(k), probability) / np.sqrt(k) for k in (1, 2, 3)]
    if probability >= 0.5:  # below, the least of rank one turns steep and the rounding of the grid shows
        assert 0.9 * min(shapes) < least
        assert most < 1.1 * max(shapes)


def test_rotations_change_nothing_and_a_batch_is_many_calls():
    turns = stats.special_ortho_group(3, seed=4).rvs(5)
    covariances = turns @ np.diag([3.0, 1.0, 0.1]) @ turns.swapaxes(1, 2)
    found = percentile(covariances, 0.95)
    # the batch stops when its last member stands still, so members differ by what is left: 1e-12
    np.testing.assert_allclose(found, percentile(np.diag([3.0, 1.0, 0.1]), 0.95), rtol=1e-11)


def test_a_coarse_tolerance_is_kept():
    covariances = np.stack([np.diag([1.0, r, r * r]) for r in np.logspace(-3, 0, 20)])
    exact = percentile(covariances, 0.95)
    np.testing.assert_allclose(percentile(covariances, 0.95, 1e-4), exact, rtol=1e-4)


@pytest.mark.parametrize("probability", [0.0, 1.0, -0.1, float("nan")])
def test_a_probability_that_is_none_is_refused(probability):
    with pytest.raises(ValueError, match="probability"):
        percentile(np.eye(3), probability)


def test_more_than_three_components_are_refused():
    with pytest.raises(ValueError, match="4 components"):
        principal_variances(np.eye(4))
