"""Quantiles that verify draws: as sharp as they say, whatever share of the flights they leave out."""

from __future__ import annotations

import numpy as np
import pytest

from planner.verify.curves import family
from planner.verify.drawn_figures import DRAWS, GROUPS, _drawn_from, _quantile, pools_of
from planner.verify.worst import peaks

ERROR = ("gyro", "bias")


@pytest.mark.parametrize("share", [0.9, 0.99])
def test_what_a_quantile_may_err_is_what_it_scatters(share: float) -> None:
    """Of flights made of few values, as those that all take one of few curves."""
    rng = np.random.default_rng(2)
    found = []
    for _ in range(60):
        pool = rng.standard_normal(800)
        took = _drawn_from(len(pool), 4000, rng)
        found.append(_quantile(np.abs(pool[took])[None], np.ones(1), share))
    scatter = np.std([one.value for one in found])
    assert np.mean([one.sigma for one in found]) == pytest.approx(scatter, rel=0.35)


def test_groups_of_flights_have_curves_of_their_own() -> None:
    """So that what their quantiles differ by is what other curves would have made of them."""
    took = _drawn_from(800, DRAWS // 10, np.random.default_rng(0)).reshape(GROUPS, -1)
    for number, group in enumerate(took):
        assert set(group) == set(range(100 * number, 100 * (number + 1)))


@pytest.mark.parametrize(("share", "count"), [(0.95, 4000), (0.997, 24_000)])
def test_rare_flights_have_more_curves_to_take_from(share: float, count: int) -> None:
    curves = {ERROR: family({1: 0.03, 3: 0.0085}, -40.0, 60.0, "largest", "kink")}
    assert len(pools_of(curves, share)[ERROR].values) == count


def test_the_worst_start_is_looked_for_on_both_sides() -> None:
    """Neighbours of the worst are no peak, nor is what is far less bad."""
    assert peaks(np.array([9.0, 5.0, 3.0, 4.0, 2.0, 9.5, 10.0])) == [6, 0]
    assert peaks(np.array([7.0, 5.0, 8.5, 4.0, 10.0])) == [4, 2]
