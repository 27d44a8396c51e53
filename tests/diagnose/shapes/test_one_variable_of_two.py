"""A curve over one variable before one over it and another; a scale factor that drifts after power-on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.chance import Flips
from planner.diagnose.hypotheses.found import Found, Question
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE, cut_chains, simplest
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.search.sensor import SIGNS, begin, diagnose_sensor
from tests.diagnose.hall import (
    FACES,
    RATES,
    Hall,
    Log,
    anywhere,
    axes_apart,
    days,
    hidden,
    read,
    two_axes,
)
from tests.diagnose.worlds import DECLARED, named, told_on_y, unnamed


def _of(*names: str) -> Pool:
    return cast(Pool, SimpleNamespace(blocks=[SimpleNamespace(name=name) for name in names]))


def test_two_variables_must_be_decisively_better_than_one_of_them() -> None:
    pool = _of("time_on_and_rate", "rate", "temperature")
    assert simplest(pool, {0: 347.0, 1: 340.0, 2: 343.0}) == 1
    assert simplest(pool, {0: 347.0, 1: 347.0 - DECISIVE - 1.0, 2: 343.0}) == 0
    assert simplest(pool, {0: 347.0, 1: 340.0, 2: 350.0}) == 2


def _in_any_order(seed: int) -> Hall:
    """Twenty-four power-ons on as many days, rests and turns of every one in an order of its own."""
    rng, log = np.random.default_rng([seed, 31]), Log()
    turns = [(axis, turn) for axis in range(3) for turn in RATES]
    for _ in range(24):
        log.on(rng.uniform(5.0, 20.0))
        degc = float(rng.choice([-40.0, 20.0, 60.0])) + 0.2 * rng.normal()
        for i in rng.permutation(6 + len(turns)):
            axis, turn = turns[i - 6] if i >= 6 else (0, 0.0)
            log.record(axis, 1.0, degc, turn=turn) if i >= 6 else log.record(*FACES[i], degc)
        log.day += 1.0 + rng.uniform(-0.2, 0.2)
    return log.hall()


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_a_scale_factor_that_drifts_while_the_unit_is_on_goes_with_both(seed: int) -> None:
    """1e-5 of the rate in 1000 s in every power-on: eight nodes of the time cost more than it tells."""
    hall = _in_any_order(seed)
    table = hidden(read(hall, seed), "gyro", 1, 1e-5 * hall.turn[:, 1] * hall.time_on / 1000.0)
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, seed).found
    assert not named(found)
    assert {(name, channels) for name, channels in unnamed(found)} == {("time_on_and_rate", "y")}


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_nothing_drifts_where_nothing_does(seed: int) -> None:
    table = read(_in_any_order(seed), seed)
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, seed).found
    assert not found.all


@pytest.mark.parametrize(("seed", "from_dps", "to_dps"), [(8, 120.0, 240.0), (3, 0.0, 60.0)])
def test_where_no_name_holds_one_variable_stands_before_two(
    seed: int, from_dps: float, to_dps: float
) -> None:
    """A rate that saturates, or sticks, in turns that grow with the time went with both."""
    turns = tuple(sign * size for size in (20.0, 60.0, 120.0, 180.0, 240.0) for sign in (1.0, -1.0))
    hall = axes_apart(seed, 3, turns)
    size = (np.clip(np.abs(hall.turn[:, 1]), from_dps, to_dps) - from_dps) / (to_dps - from_dps)
    table = hidden(replace(read(hall, seed), acc=None), "gyro", 1, 1e-3 * np.sign(hall.turn[:, 1]) * size)
    assert told_on_y(table, "gyro", seed) == (set(), {"rate"})


@pytest.mark.parametrize(("layout", "seed"), [(days, 1), (days, 2), (anywhere, 1)])
@pytest.mark.further(("layout", "seed"), [(two_axes, 1), (axes_apart, 1), (axes_apart, 2), (anywhere, 2)])
def test_several_names_give_way_to_the_simplest_that_says_as_much(
    layout: Callable[[int], Hall], seed: int
) -> None:
    """At one temperature |ω| of another axis was a curve over temperature and rate, or over the time."""
    hall, rng = layout(seed), np.random.default_rng(seed)
    hall = replace(hall, temperature=60.0 + 0.3 * rng.normal(size=len(hall.run)))
    other = np.abs(hall.turn[:, 0])
    table = hidden(replace(read(hall, seed), acc=None), "gyro", 1, 0.024 * other / np.linalg.norm(other))
    begun = begin(prepared(table), "gyro", DECLARED)
    blocks = range(len(begun.pool.blocks))
    question = Question(
        tuple(blocks[: begun.library]),
        tuple(blocks[begun.library :]),
        Flips(rng.choice([-1.0, 1.0], size=(999, len(begun.cuts))), len(begun.cuts) < SIGNS),
        lambda p, _, b: (p, b),
        lambda *_: None,
    )
    keys = [(name, (1,)) for name in ("scale_factor_asymmetry", "cross_coupling", "g_squared_sensitivity")]
    found = Found(begun.pool, [next(b for b in blocks if begun.pool.blocks[b].key == k) for k in keys], [])
    cut_chains(found, question)
    assert [begun.pool.blocks[u].name for u in found.unknown] == ["rate"]
