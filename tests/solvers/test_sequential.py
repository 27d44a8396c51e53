"""Boundaries of a test that stops early: their rates are those of drawn walks."""

from __future__ import annotations

import numpy as np
import pytest

from planner.solvers.sequential import boundaries, crossed, stopped


@pytest.mark.parametrize(("rate", "looks"), [(0.05, 1), (0.05, 5), (0.05, 20), (0.01, 10)])
def test_all_looks_together_err_at_the_rate(rate, looks):
    rng = np.random.default_rng(looks)
    walks = np.cumsum(rng.standard_normal((40_000, looks)), axis=1) / np.sqrt(np.arange(1, looks + 1))
    share = np.mean(np.any(walks >= boundaries(rate, looks), axis=1))
    # four sigma of so many draws
    assert share == pytest.approx(rate, abs=4 * np.sqrt(rate * (1 - rate) / 40_000))


def test_one_look_is_the_normal_quantile():
    assert boundaries(0.05, 1)[0] == pytest.approx(1.6448536, abs=1e-4)


@pytest.mark.parametrize(
    ("constant", "power"), [(2.413, 0.5), (2.040, 0.0)], ids=["Pocock", "O'Brien-Fleming"]
)
def test_published_boundaries(constant, power):
    """Five looks at two-sided 5 % (Jennison, Turnbull 2000, tables 2.1 and 2.3): 2.5 % on one side."""
    bounds = constant * (np.arange(1, 6) / 5) ** (power - 0.5)
    assert crossed(bounds) == pytest.approx(0.025, abs=2e-4)


def test_a_drift_stops_sooner():
    bounds = boundaries(0.05, 10)
    assert crossed(bounds, 0.5) > crossed(bounds, 0.2) > crossed(bounds) > 0.04
    assert np.all(np.diff(stopped(bounds, 0.3)) <= 1e-9)
