"""A basis comes out whether or not the quick decomposition converges."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.orthogonal import _all_seen, clear, orthonormal


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_where_the_quick_decomposition_fails_the_slow_one_gives_the_same_span(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """LAPACK's gesdd gave up on a triangle of 63 columns of a campaign: an internal error for its user."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(80, 12))
    A[:, 9:] = A[:, :3] @ rng.normal(size=(3, 3))
    quick = orthonormal(A)

    def fails(*_: object, **__: object) -> None:
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(np.linalg, "svd", fails)
    slow = orthonormal(A)
    assert slow.shape == quick.shape == (80, 9)
    np.testing.assert_allclose(slow.T @ slow, np.eye(9), atol=1e-12)
    np.testing.assert_allclose(clear(slow, A), 0.0, atol=1e-10)


@pytest.mark.parametrize("least", [1e-3, 1e-6, 1e-8, 1e-10, 0.0])
@pytest.mark.parametrize("seen", [1e-9, 1e-5])
def test_whether_all_is_seen_is_told_by_the_singular_values(least: float, seen: float) -> None:
    rng = np.random.default_rng(4)
    U, V = (np.linalg.qr(rng.normal(size=(9, 9)))[0] for _ in range(2))
    r = np.linalg.qr((U * np.array([*np.linspace(1.0, 0.5, 8), least])) @ V)[1]
    assert _all_seen(r, seen) is (least > seen)


def test_columns_that_are_nearly_one_overflow_nothing() -> None:
    """1 / 1e-200 has no square; of high_g.yaml's own plan a diagnosis ended with a warning."""
    assert not _all_seen(np.diag([1.0, 1e-200]), 1e-9)
