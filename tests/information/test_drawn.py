"""Quantiles with drawn curves, against laws that say them exactly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import erf, ndtr

from planner.information import exact
from planner.information.curve_weights import CurveWeights
from planner.information.curves import unseen_curves
from planner.information.drawn import (
    SETTLED,
    SHORTER,
    _at_one,
    drawn,
)
from planner.information.even import even
from planner.information.exchange import Judge
from planner.information.in_flight import Asked
from planner.information.model_of import on_offer
from planner.information.whole_flights import Flights, length_of_share
from planner.nouns.array import Array
from planner.solvers.gaussian_length import percentile
from planner.spec.model import PercentileRule
from tests.information import cases
from tests.information.test_promise import tree
from tests.specs import loaded

ERROR = ("gyro", "bias")
SHARES = (0.5, 0.9, 0.95, 0.99)


def asked(share: float, scenarios: int, instants: int, components: int, *, worst: bool = False) -> Asked:
    weights = None if worst else np.full(scenarios, 1.0 / scenarios)
    nothing = np.zeros((scenarios, 1))
    response = np.zeros((1, instants, components, 1, 1))
    return Asked(0, 1.0, share, weights, nothing, tuple(range(instants)), nothing, response, nothing)


def weights_of(J: Array, scenarios: int) -> CurveWeights:
    """One point, the same at every temperature. J: (ρ,)"""
    places = np.zeros((scenarios, 1), dtype=np.intp)
    return CurveWeights(ERROR, places, np.broadcast_to(J[:, None], (scenarios, len(J), 1)))


def moved(weights: CurveWeights, square: float) -> list[tuple[CurveWeights, Array]]:
    """A curve of one mean square at its only point, with what d takes from it."""
    return [(weights, weights.second_moment(np.array([[square]])))]


def quantile_of(*flights: Any, **more: Any) -> float | None:
    found = drawn(*flights, **more)
    return None if found is None else found.quantile()


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("size", [0.5, 2.0])
def test_a_curve_of_one_size_shifts_a_gaussian(share: float, size: float) -> None:
    """f = ±s beside N(0, 1): P(|d| <= r) = ½ erf((r + s)/√2) + ½ erf((r − s)/√2)."""
    a, rest = asked(share, 1, 1, 1), np.ones((1, 1, 1))
    pool = np.full((2, 1), size)
    parts = moved(weights_of(np.ones(1), 1), size**2)
    found = quantile_of(a, rest, parts, lambda e: pool.T)

    def missing(r: float) -> float:
        root = np.sqrt(2.0)
        return float(0.5 * (erf((r + size) / root) + erf((r - size) / root)) - share)

    assert found == pytest.approx(brentq(missing, 0.0, 20.0), rel=1e-4)


@pytest.mark.parametrize("components", [1, 2, 3])
@pytest.mark.parametrize("instants", [1, 2])
@pytest.mark.parametrize("worst", [False, True])
def test_gaussian_curves_leave_a_gaussian(components: int, instants: int, worst: bool) -> None:
    """Then the covariance says the quantile, and of two equal instants as of one."""
    rng = np.random.default_rng(components)
    rest = np.diag([0.3, 1.0, 2.0][:components])
    J = np.array([1.0, 0.5, 0.2])[:components]
    pool = rng.normal(size=(40_000, 1))
    a = asked(0.95, 3, instants, components, worst=worst)
    one = np.tile(rest, (instants, instants))
    found = quantile_of(
        a,
        np.broadcast_to(one, (3, *one.shape)),
        moved(weights_of(np.tile(J, instants), 3), 1.0),
        lambda e: pool.T,
    )
    exact = float(percentile(rest + np.outer(J, J), 0.95))
    assert found == pytest.approx(exact, rel=0.015)


def test_where_no_curve_matters_nothing_is_drawn() -> None:
    a, small = asked(0.95, 1, 1, 1), weights_of(np.full(1, 0.05), 1)

    def never(error: object) -> Array:
        raise AssertionError("drawn")

    assert quantile_of(a, np.ones((1, 1, 1)), moved(small, 1.0), never) is None


@pytest.mark.parametrize("share", [0.95, 0.99, 0.997])
def test_the_worst_of_many_temperatures_is_no_worse_for_being_drawn(share: float) -> None:
    """Forty alike, two equal instants, no curve: the largest of forty scattered quantiles is above theirs."""
    rest = np.tile(np.diag([1.0, 0.5, 0.1]), (2, 2))
    found = quantile_of(asked(share, 40, 2, 3, worst=True), np.broadcast_to(rest, (40, 6, 6)), [], len)
    assert found == pytest.approx(float(percentile(rest[:3, :3], share)), rel=0.006)


def test_the_worst_temperature_is_looked_for_on_both_sides() -> None:
    """A Gaussian of variance 1.1 and 1.05 at one end, a seldom large curve of mean square 1 at the other."""
    rng = np.random.default_rng(4)
    pool = np.where(rng.random((40_000, 1)) < 0.04, 5.0, 0.0)
    rest = np.array([0.01, 0.01, 0.01, 1.05, 1.1])[:, None, None] * np.eye(1)
    weights = np.array([1.0, 0.0, 0.0, 0.0, 0.0])[:, None, None]
    part = CurveWeights(ERROR, np.zeros((5, 1), dtype=np.intp), weights)
    parts = [(part, part.second_moment(np.ones((1, 1))))]
    found = quantile_of(asked(0.99, 5, 1, 1, worst=True), rest, parts, lambda e: pool.T)
    assert found == pytest.approx(5.0, abs=0.15)


def test_rare_flights_are_judged_by_more_curves() -> None:
    """Three in a thousand of 8000 are 24 curves, whose largest scatter by 3 %."""
    made = loaded(tree("level")).spec
    for percentile_of, count in (("95 %", 8000), ("99 %", 16_000), ("99.7 %", 32_000)):
        rule = PercentileRule.model_validate({"percentile": percentile_of})
        wanted = made.requirement[0].model_copy(update={"rule": rule})
        assert unseen_curves(made.model_copy(update={"requirement": (wanted,)})) == count


def test_long_tails_lengthen_high_quantiles_and_shorten_low_ones() -> None:
    """A curve that is seldom large, beside a Gaussian one of the same mean square."""
    rng = np.random.default_rng(5)
    pool = np.where(rng.random((20_000, 1)) < 0.04, 5.0, 0.0)
    moment = np.array([[float(np.mean(pool**2))]])
    total = np.array([[0.2 + moment[0, 0]]])
    for share, longer in ((0.9, False), (0.99, True)):
        found = quantile_of(
            asked(share, 1, 1, 1),
            np.full((1, 1, 1), 0.2),
            moved(weights_of(np.ones(1), 1), float(moment[0, 0])),
            lambda e: pool.T,
        )
        assert found is not None
        assert (found > float(percentile(total[None], share)[0])) == longer


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("instants", [1, 2])
def test_what_all_flights_have_shifts_a_gaussian(share: float, instants: int) -> None:
    """P(|d| <= r) = Φ(r − m) − Φ(−r − m), at one instant, or at two of which the other hardly moves."""
    a, rest = asked(share, 1, instants, 1), np.diag([1.0, 1e-4])[None, :instants, :instants]
    found = quantile_of(a, rest, [], lambda e: np.empty((1, 0)), shift=np.full((1, instants), 0.8))
    assert found is not None
    assert ndtr(found - 0.8) - ndtr(-found - 0.8) == pytest.approx(share, abs=0.003)


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("weighted", [True, False])
def test_the_first_guess_does_not_matter(share: float, weighted: bool) -> None:
    """Whichever way the root is found, by secants or by halving: the same length."""
    rng = np.random.default_rng(7)
    pool = rng.choice([0.0, 1.0, 6.0], p=[0.5, 0.45, 0.05], size=(2000, 1))
    a, rest = asked(share, 3, 1, 2, worst=not weighted), np.broadcast_to(np.diag([0.2, 1.0]), (3, 2, 2))
    part = weights_of(np.array([1.0, 0.3]), 3)
    curves = {part.error: pool.T.astype(np.float32)}
    guesses = (2.0, 0.01, 0.5, 8.0, 300.0)
    still = np.zeros((3, 2))
    every = [_at_one(a, rest, still, [part], curves, a.weights, near, 60_000).quantile() for near in guesses]
    assert np.ptp(every) < 3 * SETTLED * every[0]


@pytest.mark.parametrize("share", [0.3, 0.95, 0.999])
@pytest.mark.parametrize("instants", [1, 3])
@pytest.mark.parametrize("worst", [False, True])
def test_flights_are_within_a_length_as_their_quantile_says(share: float, instants: int, worst: bool) -> None:
    """On both sides of it, without looking for it."""
    rng = np.random.default_rng(11)
    pool = rng.choice([0.0, 1.0, 6.0], p=[0.5, 0.45, 0.05], size=(2000, 1))
    S, rows = 4, 2 * instants
    rest = np.stack([scale * np.eye(rows) for scale in (0.2, 0.5, 1.0, 0.7)])
    part = weights_of(np.linspace(0.2, 1.0, rows), S)
    a = asked(share, S, instants, 2, worst=worst)
    found = drawn(a, rest, moved(part, float(np.mean(pool**2))), lambda e: pool.T.astype(np.float32))
    assert found is not None
    length = found.quantile()
    for factor in (0.2, 0.9, 0.999, 1.001, 1.1, 5.0):
        assert found.are_within(factor * length) == (factor > 1.0)


@pytest.mark.parametrize("instants", [1, 3])
@pytest.mark.parametrize("size", [1e18, 1e27])
def test_flights_of_any_size_are_drawn(size: float, instants: int) -> None:
    """A vertical channel that nothing aids is off by 1e27 m after ten hours: no square of it is single."""
    pool = np.random.default_rng(2).standard_t(5, (2000, 1))
    rows = 2 * instants
    rest = np.stack([np.diag(np.linspace(1.0, 2.0, rows))] * 2)  # axes of its own: rounding chooses none
    a, square = asked(0.95, 2, instants, 2), float(np.mean(pool**2))
    part = weights_of(np.linspace(0.5, 1.0, rows), 2)
    usual = drawn(a, rest, moved(part, square), lambda e: pool.T.astype(np.float32))
    larger = moved(part.times(size), square)
    found = drawn(a, rest * size**2, larger, lambda e: pool.T.astype(np.float32))
    assert usual is not None
    assert found is not None
    length = found.quantile()
    assert length == pytest.approx(size * usual.quantile(), rel=1e-3)
    assert [found.are_within(factor * length) for factor in (0.99, 1.01)] == [False, True]


def test_a_campaign_that_breaks_by_far_is_known_as_such_without_its_figures() -> None:
    """Under each family alone as under all of them; what is within what draws scatter by is not."""
    shown = set[bool]()
    for seed in (3001, 3003):
        made = cases.tree(seed)
        loose = cases.flight(made)
        offers, promise = on_offer(loose)
        limits = np.median(exact.unseen(loose, offers.visits(even(offers, 2))).figures, axis=0)
        flight = cases.flight(cases.limited(made, limits))
        offers, promise = on_offer(flight)
        judge = Judge(promise)
        for temperatures, repeats in ((1, 1), (2, 1), (4, 12)):
            n = repeats * even(offers, temperatures)
            visits = offers.visits(n)
            beyond = np.any(exact.unseen(flight, visits).figures > exact.BY_FAR * flight.limits, axis=1)
            for name, own in zip(promise.families, beyond, strict=True):
                assert exact.broken_by_far(flight, visits, [name]) == own
            assert exact.broken_by_far(flight, visits, judge.worst_first(n)) == beyond.any()
            shown |= set(beyond.tolist())
    assert shown == {False, True}


@pytest.mark.parametrize("share", [0.5, 0.95, 0.999])
@pytest.mark.parametrize("shifted", [0.0, 3.0])
@pytest.mark.parametrize("worst", [False, True])
def test_flights_that_are_not_looked_at_change_nothing(share: float, shifted: float, worst: bool) -> None:
    """The same length as when every flight is looked at."""
    rng = np.random.default_rng(5)
    axes = rng.normal(size=(40, 5)).astype(np.float32)
    x = (rng.normal(size=(3, 5, 4000)) * np.array([[4.0], [2.0], [1.0], [0.5], [0.1]])).astype(np.float32)
    flights = Flights(axes, x, np.full((3, 40), shifted, dtype=np.float32), 2)
    every = flights.beyond(0.0)
    length = length_of_share(every, share, None if worst else np.array([0.2, 0.3, 0.5]))
    some = flights.beyond(SHORTER * length)
    assert length_of_share(some, share, None if worst else np.array([0.2, 0.3, 0.5])) == length
    assert np.array_equal(some[some > 0], every[some > 0])
    assert np.all(every[some == 0] < SHORTER * length)
    vectors = np.einsum("rk,skn->srn", axes.astype(float), x.astype(float)) + shifted
    longest = np.sqrt((vectors.reshape(3, 20, 2, -1) ** 2).sum(axis=2).max(axis=1))
    assert every == pytest.approx(longest, rel=1e-4)


@pytest.mark.parametrize("instants", [1, 2])
def test_other_curves_are_drawn_at_every_temperature(instants: int) -> None:
    """Long tails at thirty temperatures: as sharp as all their flights, not as those of one of them."""
    S, draws = 30, 30_000
    a, rest = asked(0.95, S, instants, 1), np.broadcast_to(1e-4 * np.eye(instants), (S, instants, instants))
    rng = np.random.default_rng(3)
    found = []
    for _ in range(20):
        pool = rng.standard_t(4, (40_000, 1))
        parts = moved(weights_of(np.ones(instants), S), float(np.mean(pool**2)))
        value = quantile_of(a, rest, parts, lambda e, pool=pool: pool.T, draws)
        assert value is not None
        found.append(value / np.quantile(np.abs(pool), 0.95))
    # √(.05 .95 / 30 000) of a probability is 0.7 % of this quantile; of a thousand flights it would be 4 %
    assert np.std(found) < 0.013
    assert np.mean(found) == pytest.approx(1.0, abs=0.01)


def test_close_to_a_limit_more_flights_tell_on_which_side_it_is() -> None:
    """Draws are the same ones whatever the limit; away from it the usual number does."""
    made = cases.tree(3002)

    def of(limits: Array | None, draws: int = exact.FLIGHTS) -> Array:
        flight = cases.flight(made if limits is None else cases.limited(made, limits))
        every = cases.Everything(flight)
        n = np.minimum(np.ones(len(every.offers.kinds)) * 2, 2)
        return exact.foreseen(flight.unseen, exact.laid_out(flight, every.offers.visits(n)), draws).figures

    usual = of(1e3 * of(None).max(axis=0))
    near = usual.max(axis=0) * (1.0 + 0.5 * exact.CLOSE)
    close = np.abs(usual / near - 1.0) < exact.CLOSE
    assert close.any()
    assert not close.all()
    more = of(near, exact.CLOSELY)
    assert np.array_equal(of(near), np.where(close, more, usual))
    assert not np.array_equal(more[close], usual[close])
