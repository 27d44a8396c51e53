"""The stated error rates hold on the limit itself, where they are hardest to hold."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InputError
from planner.fleet.acceptance import accepted
from planner.fleet.allowed_region import PARTS, Reserve, reserve_of
from planner.fleet.check_groups import by_temperature
from planner.fleet.check_residual import check_residuals
from planner.fleet.judge import ErrorRates, judged, room_left, to_accept
from tests.fleet.fleets import DEG, G, check_table, measured, region, small_basis

RATES = ErrorRates(0.05, 0.05)
RULES = [("worst_case", None), ("rss", None), ("percentile", 0.95)]
UNITS = 600
# three sigma of a share of 5 % among 1200 units: 0.05 + 3 sqrt(0.05 · 0.95 / 1200)
MOST_WRONG = 0.05 + 3 * np.sqrt(0.05 * 0.95 / UNITS)


def kept(area, one) -> Reserve:
    shares = np.ones((1, len(area.terms), len(PARTS)))
    shares[:, :, PARTS.index("estimate")] = 0.0
    return reserve_of(area, shares)[0]


def on_the_limit(area, direction: np.ndarray, load: float) -> np.ndarray:
    """The residual along a direction with a given load: halved until it stands."""
    low, high = 0.0, 1e3
    reserve = kept(area, None)
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if area.load(middle * direction, reserve) < load else (low, middle)
    return low * direction


def verdicts(area, true: np.ndarray, covariance: np.ndarray, rng, count: int = UNITS) -> list[str]:
    root = np.linalg.cholesky(covariance)
    reserve = kept(area, None)
    seen = true + rng.normal(size=(count, len(true))) @ root.T
    values = np.stack(
        [area.value(c, seen, Reserve(reserve.sums, reserve.squares)) for c in area.constraints], axis=1
    )
    return [
        judged(area, measured(m, covariance), v, RATES).verdict for m, v in zip(seen, values, strict=True)
    ]


def covariances(seed: int, terms: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(terms, terms)) * 0.5 + 2.0 * np.eye(terms)
    return 0.01 * root @ root.T


@pytest.mark.parametrize(("rule", "probability"), RULES, ids=[r for r, _ in RULES])
@pytest.mark.parametrize("sparse", [False])
@pytest.mark.further("sparse", [True])
def test_bad_units_just_past_the_limit_are_rarely_accepted(rule, probability, sparse):
    area = region(rule, probability=probability)
    rng = np.random.default_rng(11)
    direction = np.eye(6)[2] if sparse else rng.normal(size=6)
    bad = on_the_limit(area, direction, 1.0 + 1e-6)
    found = verdicts(area, bad, covariances(3, 6), rng)
    assert found.count("accepted") / UNITS <= MOST_WRONG


@pytest.mark.parametrize(("rule", "probability"), RULES, ids=[r for r, _ in RULES])
@pytest.mark.parametrize("sparse", [False])
@pytest.mark.further("sparse", [True])
def test_good_units_just_inside_the_limit_are_rarely_rejected(rule, probability, sparse):
    area = region(rule, probability=probability)
    rng = np.random.default_rng(12)
    direction = np.eye(6)[2] if sparse else rng.normal(size=6)
    good = on_the_limit(area, direction, 1.0 - 1e-6)
    found = verdicts(area, good, covariances(3, 6), rng)
    assert found.count("rejected") / UNITS <= MOST_WRONG


def test_the_test_has_power():
    """Otherwise `undecided` for everyone would pass the two tests above."""
    area = region("worst_case")
    rng = np.random.default_rng(13)
    direction = rng.normal(size=6)
    small = covariances(3, 6) / 50
    good = verdicts(area, on_the_limit(area, direction, 0.7), small, rng, 300)
    bad = verdicts(area, on_the_limit(area, direction, 1.4), small, rng, 300)
    assert good.count("accepted") == 300
    assert bad.count("rejected") == 300


@pytest.mark.parametrize("rule", ["rss", "percentile"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_is_accepted_is_good_wherever_the_residual_may_be(rule, seed):
    """No residual of the ellipsoid has a larger T than the margin says; of squares the margin is the
    largest."""
    area = region(rule, probability=0.95 if rule == "percentile" else None)
    rng, c = np.random.default_rng(seed), area.constraints[0]
    seen, covariance, reserve = 0.7 * rng.normal(size=6), covariances(seed, 6), kept(area, None)
    value = area.value(c, seen, reserve)
    margin = float(to_accept(c, measured(seen, covariance), seen, value, 0.05))
    root, around = 1.6448536 * np.linalg.cholesky(covariance), rng.normal(size=(200, 6))
    for _ in range(60 if rule == "rss" else 1):  # up the slope of T², which is convex
        around /= np.linalg.norm(around, axis=1)[:, None]
        there = seen + around @ root.T
        around = (c.lengths**2 * there) @ root
    most = float(area.value(c, there, reserve).max() - value)
    assert most <= margin + 1e-9
    if rule == "rss":
        assert most == pytest.approx(margin, rel=1e-6)


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 10_000), rule=st.sampled_from([r for r, _ in RULES]))
def test_more_records_never_widen_the_margins(seed, rule):
    area = region(rule, probability=0.95 if rule == "percentile" else None)
    rng = np.random.default_rng(seed)
    true = on_the_limit(area, rng.normal(size=6), 1.1)
    value = np.array([float(area.value(c, true, kept(area, None))) for c in area.constraints])
    covariance = covariances(seed, 6)
    few, many = (judged(area, measured(true, covariance / n), value, RATES) for n in (1, 4))
    assert np.all(many.to_accept <= few.to_accept)
    # 4000 draws leave 2 % on a quantile
    assert np.all(many.to_reject <= 1.02 * few.to_reject)


def test_the_further_records_decide_if_the_residual_stays():
    area = region("worst_case")
    direction = np.random.default_rng(5).normal(size=6)
    for load, verdict in ((0.9, "accepted"), (1.1, "rejected")):
        true, covariance = on_the_limit(area, direction, load), covariances(3, 6)
        value = np.array([float(area.value(c, true, kept(area, None))) for c in area.constraints])
        first = judged(area, measured(true, covariance), value, RATES)
        assert first.verdict == "undecided"
        # the folded part of the margin shrinks faster than the root: foretold is enough, half is not
        enough = judged(area, measured(true, covariance / (1.05 * first.needed())), value, RATES)
        assert enough.verdict == verdict
    half = judged(area, measured(true, covariance / (0.3 * first.needed())), value, RATES)
    assert half.verdict == "undecided"


@pytest.mark.parametrize("rule", ["worst_case", "rss"])
def test_the_room_of_a_term_ends_on_the_limit(rule):
    area = region(rule)
    residual = on_the_limit(area, np.random.default_rng(2).normal(size=6), 0.8)
    reserve = kept(area, None)
    room = room_left(area, residual, reserve, range(len(area.constraints)))
    for t in range(6):
        edge = residual.copy()
        edge[t] = room[t]
        assert area.load(edge, reserve) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("rate", [0.0, 0.5, -1.0, 2.0])
def test_rates_that_are_none_are_refused(rate):
    with pytest.raises(InputError, match="must lie between"):
        ErrorRates(rate, 0.05)


# ---------------------------------------------------------------- from dwell tables


def judged_units(gyro, acc, seed):
    basis = small_basis()
    table = check_table(gyro, acc, np.random.default_rng(seed))
    found = check_residuals(table, by_temperature(table), basis.models, basis.region)
    return accepted(found, basis.region, (-60.0, 60.0), RATES)


def batch(load: float, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Biases in random directions whose true load, with what flights add, is `load`."""
    basis = small_basis()
    rng = np.random.default_rng(seed)
    shape = rng.normal(size=(count, 6)) * np.repeat([0.003 * DEG, 0.002 * G], 3)
    shares = np.zeros((1, 6, len(PARTS)))
    shares[:, :, [PARTS.index(p) for p in ("run_to_run", "in_run", "storage")]] = 1.0
    reserve = reserve_of(basis.region, shares)[0]
    c = basis.region.constraints[0]
    free = load * c.limit - float(c.lengths @ reserve.sums)
    shape *= (free / (np.abs(shape) @ c.lengths))[:, None]
    order = [basis.region.index(e, t) for e in ("gyro.bias", "accelerometer.bias") for t in "xyz"]
    assert order == list(range(6)) or order == [3, 4, 5, 0, 1, 2]
    gyro, acc = (shape[:, :3], shape[:, 3:]) if order[0] == 0 else (shape[:, 3:], shape[:, :3])
    return gyro, acc


def test_checked_units_on_the_limit_keep_both_rates():
    """A sample; thousands of units are judged by benchmarks/bench_fleet.py."""
    for load, wrong, seed in ((1.0 + 1e-6, "accepted", 21), (1.0 - 1e-6, "rejected", 22)):
        units = judged_units(*batch(load, 200, seed), seed)
        assert len(units) == 200
        share = sum(u.verdict == wrong for u in units) / 200
        assert share <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 200)


def test_clear_units_are_told_apart_and_the_channel_at_fault_is_named():
    gyro, acc = batch(0.75, 40, 31)
    acc[7, 1] += 0.05 * G
    units = judged_units(gyro, acc, 32)
    bad = units[7]
    assert bad.verdict == "rejected"
    assert [c.place for c in bad.channels if c.channel == "accelerometer_y"] == ["outside"]
    assert {u.verdict for u in units if u is not bad} <= {"accepted", "undecided"}
    assert sum(u.verdict == "accepted" for u in units) >= 35


def test_residuals_of_a_check_lie_in_their_intervals():
    basis = small_basis()
    gyro, acc = batch(0.8, 300, 41)
    table = check_table(gyro, acc, np.random.default_rng(42))
    found = check_residuals(table, by_temperature(table), basis.models, basis.region)
    places = [basis.region.index("gyro.bias", axis) for axis in "xyz"]
    error = np.array([f.residual[places] - gyro[int(f.unit[1:])] for f in found])
    sigma = np.array([np.sqrt(np.diag(f.covariance)[places]) for f in found])
    inside = np.mean(np.abs(error) <= 1.959964 * sigma)
    # 2700 intervals: three sigma of their share is 1.3 %
    assert inside == pytest.approx(0.95, abs=0.013)


def test_a_unit_that_scatters_more_than_its_budget_is_judged_by_its_own_spread():
    gyro, acc = batch(0.8, 1, 51)
    table = check_table(gyro, acc, np.random.default_rng(52), run_to_run=(0.008 * DEG, 0.004 * G))
    basis = small_basis()
    (unit,) = accepted(
        check_residuals(table, by_temperature(table), basis.models, basis.region),
        basis.region,
        (-60.0, 60.0),
        RATES,
    )
    assert any("scatters" in note for note in unit.notes)
    calm = judged_units(gyro, acc, 52)[0]
    # four times the spread, which 18 power-ons tell to a quarter
    assert unit.high - unit.load > 3 * (calm.high - calm.load)


def test_a_check_without_readings_says_what_it_needs():
    basis = small_basis()
    table = check_table(*batch(0.8, 1, 61), np.random.default_rng(1))
    from dataclasses import replace

    blind = replace(table, ref_rate=None, ref_acc=None)
    with pytest.raises(InputError, match="a check needs gyro_"):
        check_residuals(blind, by_temperature(blind), basis.models, basis.region)
