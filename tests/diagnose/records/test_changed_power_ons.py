"""Sums over sets of power-ons are those of their members, in turn or apart."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.diagnose.records.changed_power_ons import sets_of, sums_over


@given(st.integers(1, 40).flatmap(lambda w: st.tuples(st.just(w), st.integers(1, 20), st.integers(0, 2**32))))
def test_sums_over_any_sets_are_those_of_their_members(drawn: tuple[int, int, int]) -> None:
    count, runs, seed = drawn
    rng = np.random.default_rng(seed)
    first, behind = np.sort(rng.integers(0, runs + 1, (2, count)), axis=0)
    order = np.arange(runs)
    turns = (order >= first[:, None]) & (order < behind[:, None])
    sets = np.where(rng.random(count)[:, None] < 0.5, turns, rng.random((count, runs)) < 0.5)
    each = rng.normal(size=(runs, 2, 3))
    sums = np.array([each[there].sum(axis=0) for there in sets])
    assert np.allclose(sums_over(sets)(each), sums, rtol=1e-12, atol=1e-12)


def test_sets_of_six_power_ons_are_all_from_one_on_of_a_day_in_turn_and_alone() -> None:
    sets, spans = sets_of(np.array([0.0, 0.1, 1.0, 1.1, 2.0, 2.1]), first_day=False)
    told = ["".join(map(str, there.astype(int))) for there in sets]
    asked = {span: [one for one, of in zip(told, spans, strict=True) if of == span] for span in spans}
    assert asked == {
        "throughout": ["111111"],
        "on": ["001111", "000111", "000011"],
        "day": ["001100", "000011"],
        "while": ["011000", "011100", "001100"],
        "alone": ["100000", "010000", "001000", "000100", "000010", "000001"],
    }


def test_power_ons_of_one_day_may_lie_among_others() -> None:
    day = np.array([0.0, 0.1, 3.0, 3.1, 0.2, 0.3, 3.2, 6.0, 6.1])
    sets, _ = sets_of(day, first_day=True)
    each = np.arange(len(day), dtype=float)
    assert np.allclose(sums_over(sets)(each), sets @ each, rtol=1e-12)
