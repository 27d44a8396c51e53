"""The quick law of lengths against the exact one, as good as it says."""

from __future__ import annotations

import numpy as np
import pytest

from planner.nouns.array import Array
from planner.solvers.gaussian_length import exceedance, percentile
from planner.solvers.length_share import length_within, share_by_moments, variances_along, within

GOOD_TO = {0.5: 2e-3, 0.6: 2e-3, 0.8: 2e-4, 0.9: 2e-4, 0.95: 2e-4, 0.99: 2e-4, 0.999: 2e-4, 1 - 1e-9: 2e-4}


def covariances(components: int, count: int, seed: int) -> Array:
    """Of all shapes: the variances of the axes apart by up to eight decades, turned at random."""
    rng = np.random.default_rng(seed)
    variance = 10.0 ** -rng.uniform(0.0, 8.0, (count, components))
    variance[::7] = 1.0
    Q = np.linalg.qr(rng.normal(size=(count, components, components)))[0]
    return np.asarray(Q @ (variance[:, :, None] * np.swapaxes(Q, 1, 2)))


@pytest.mark.parametrize("components", [1, 2, 3])
@pytest.mark.parametrize("share", GOOD_TO)
def test_lengths_are_as_good_as_it_says(components: int, share: float) -> None:
    S = covariances(components, 300, 0)
    along, c = variances_along(S)
    found = length_within(along[:, None], c, share, np.ones(1))
    wanted = percentile(S, share, 1e-10)
    np.testing.assert_allclose(found, wanted, rtol=GOOD_TO[share])
    at = within(along, c, wanted)
    np.testing.assert_allclose(at, share, atol=GOOD_TO[share])


@pytest.mark.parametrize("share", [0.005, 0.02, 0.3, 0.999_999_999])
def test_one_component_is_the_normal_law_at_any_share(share: float) -> None:
    """Shares from which a bracket of the bisection would be missed."""
    S = covariances(1, 20, 1)
    along, c = variances_along(S)
    np.testing.assert_allclose(
        length_within(along[:, None], c, share, np.ones(1)), percentile(S, share), rtol=1e-4
    )


@pytest.mark.parametrize("components", [1, 2, 3])
def test_mixtures_of_very_different_flights(components: int) -> None:
    """The share beyond the length found, by the exact law, is as asked; the worst is the worst one."""
    rng = np.random.default_rng(2)
    S = covariances(components, 60, 3).reshape(10, 6, components, components)
    S = S * 10.0 ** rng.uniform(-3.0, 3.0, (10, 6, 1, 1))
    weights = rng.dirichlet(np.ones(6))
    along, c = variances_along(S)
    for share in (0.8, 0.95):
        r = length_within(along, c, share, weights)
        beyond = exceedance(S, np.broadcast_to(r[:, None], (10, 6))) @ weights
        np.testing.assert_allclose(beyond, 1.0 - share, atol=2e-3)
        worst = length_within(along, c, share, None)
        np.testing.assert_allclose(worst, percentile(S, share).max(axis=1), rtol=2e-4)


def test_four_components_are_refused() -> None:
    with pytest.raises(ValueError, match="at most three"):
        variances_along(np.eye(4))


@pytest.mark.parametrize("components", [1, 2, 3])
@pytest.mark.parametrize("share", [0.8, 0.9, 0.95, 0.99, 0.999])
def test_moments_alone_know_a_length_to_five_per_cent(components: int, share: float) -> None:
    S = covariances(components, 300, 4)
    wanted = percentile(S, share)
    more, less = (
        np.array([share_by_moments(one, factor * r) for one, r in zip(S, wanted, strict=True)])
        for factor in (1.05, 0.95)
    )
    assert np.all(more >= share)
    assert np.all(less <= share)
