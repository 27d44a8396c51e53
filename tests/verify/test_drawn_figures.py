"""Quantiles that verify draws: as sharp as they say, whatever share of the flights they leave out."""

from __future__ import annotations

import numpy as np
import pytest

from planner.verify import drawn_figures, second_moments
from planner.verify.curve_shapes import SHAPES
from planner.verify.curves import family
from planner.verify.drawn_figures import DRAWS, GROUPS, _drawn_from, _quantile, pools_of
from planner.verify.second_moments import moments_of
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


@pytest.mark.parametrize(("share", "count"), [(0.95, 12_000), (0.997, 24_000)])
def test_rare_flights_have_more_curves_to_take_from(share: float, count: int) -> None:
    curves = {ERROR: family({1: 0.03, 3: 0.0085}, -40.0, 60.0, "largest", "kink")}
    assert len(pools_of(curves, share)[ERROR].values) == count


def test_the_worst_start_is_looked_for_on_both_sides() -> None:
    """Neighbours of the worst are no peak, nor is what is far less bad."""
    assert peaks(np.array([9.0, 5.0, 3.0, 4.0, 2.0, 9.5, 10.0])) == [6, 0]
    assert peaks(np.array([7.0, 5.0, 8.5, 4.0, 10.0])) == [4, 2]


@pytest.mark.parametrize("shape", SHAPES)
def test_what_another_table_drew_changes_nothing(shape: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Curves that a process remembers are those that it would draw anew."""
    monkeypatch.setattr(drawn_figures, "_POOLS", {})
    own = {ERROR: family({1: 0.03, 3: 0.0085}, -40.0, 60.0, "largest", shape)}
    for remembered in (second_moments._of_tables, second_moments._remembered):
        remembered.cache_clear()
    moment, pool = moments_of(own)[ERROR].value, pools_of(own, 0.95)[ERROR].values
    second_moments._of_tables.cache_clear()
    drawn_figures._POOLS.clear()
    for table in ({1: 0.05, 3: 0.02}, {1: 0.04, 2: 0.03}):
        other = {ERROR: family(table, -40.0, 60.0, "largest", shape)}
        assert not np.array_equal(moments_of(other)[ERROR].value, moment)
        assert not np.array_equal(pools_of(other, 0.95)[ERROR].values, pool)
    np.testing.assert_array_equal(moments_of(own)[ERROR].value, moment)
    np.testing.assert_array_equal(pools_of(own, 0.95)[ERROR].values, pool)
    assert pools_of(own, 0.95)[ERROR] is pools_of(own, 0.95)[ERROR]


def test_pools_are_forgotten_where_they_are_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawn_figures, "_POOLS", {})
    monkeypatch.setattr(drawn_figures, "MOST_KEPT", 15_000_000)  # two of 6 MB
    for table in ({1: 0.05}, {1: 0.04}, {1: 0.03}):
        pools_of({ERROR: family(table, -40.0, 60.0, "largest", "kink")}, 0.95)
    assert len(drawn_figures._POOLS) == 2


def test_nets_that_are_remembered_are_those_that_would_be_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawn_figures, "_NORMALS", {})
    monkeypatch.setattr(drawn_figures, "MOST_NORMALS", 3 * 4 * 96 * 5)  # bytes of three
    for net in (0, 1, 2, 0, 3, 4, 0, 1):
        found = drawn_figures._remembered_normals(net, 96, 5)
        assert np.array_equal(found, drawn_figures._normals(net, 96, 5))
        assert len(drawn_figures._NORMALS) <= 3
    assert not np.array_equal(drawn_figures._normals(0, 96, 5), drawn_figures._normals(1, 96, 5))
