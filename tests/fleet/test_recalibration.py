"""Recalibration in store: what is left equals what a simulated store leaves; no schedule is cheaper."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InputError
from planner.fleet.allowed_region import PARTS, reserve_of
from planner.fleet.growth import growth_of
from planner.fleet.published_store import published, published_check
from planner.fleet.store import StoreBench, attitudes, sensor_left, store_records, visit_time, visits
from planner.fleet.visits import StorePlanner, grid
from planner.nouns.allowances import ErrorModel
from planner.pipelines.fleet import ForecastOptions, basis_of, recalibrate
from planner.spec.recalibration import Recalibration
from tests.fleet.fleets import DEG, G, small_basis
from tests.specs import loaded, small, with_limit

ASKED = Recalibration(angle_error="0.05 deg", level="0.1 deg", repeats=6)
EARTH = 7.292115e-5


def quiet(message: str) -> None:
    del message


# ---------------------------------------------------------------- what a visit leaves


def test_the_attitudes_are_rotations_that_show_every_face():
    for C in attitudes():
        assert pytest.approx(np.eye(3), abs=1e-12) == C @ C.T
        assert np.linalg.det(C) == pytest.approx(1.0)
    assert {tuple(C[:, 2].round()) for C in attitudes()} == {
        tuple(s * np.eye(3)[a]) for a in range(3) for s in (1.0, -1.0)
    }


MODELS = [
    ErrorModel(
        "gyro.bias", "deg/s", 0.03 * DEG, ((float("nan"), 0.002 * DEG),), 0.0, 0.001 * DEG, 0.03 * DEG, True
    ),
    ErrorModel("gyro.scale_factor", "1", 0.005, ((float("nan"), 2e-5),), 0.0, 2e-5, 0.005, True),
    ErrorModel(
        "accelerometer.bias", "g", 0.02 * G, ((float("nan"), 0.001 * G),), 0.0, 0.001 * G, 0.02 * G, True
    ),
    ErrorModel("accelerometer.scale_factor", "1", 0.005, ((float("nan"), 2e-5),), 0.0, 2e-5, 0.005, True),
]


def drawn_store(repeats: int, count: int, seed: int) -> dict[str, np.ndarray]:
    """Errors of a plain estimator (means over faces, angles over turns) on simulated visits, x axis.

    Half sums and half differences of faces up and down, means of all rests: nothing of the program's design.
    """
    rng = np.random.default_rng(seed)
    rests, found = (
        12,
        {
            name: []
            for name in ("gyro.bias", "gyro.scale_factor", "accelerometer.bias", "accelerometer.scale_factor")
        },
    )
    C = attitudes()
    half = np.diag([-1.0, -1.0, 1.0])
    rooms = np.concatenate([C, C @ half])
    up = rooms[:, 0, 2]  # x axis of the body along the vertical
    for _ in range(count):
        heading = rng.uniform(0, 2 * np.pi)
        earth = EARTH * np.array([0.7 * np.cos(heading), 0.7 * np.sin(heading), 0.7])
        tilt, square = rng.normal(size=2) * 0.1 * DEG, rng.normal(size=(6, 2)) * 0.1 * DEG
        gyro, acc = np.zeros(rests), np.zeros(rests)
        bias_rr, acc_rr = rng.normal(size=repeats) * 0.002 * DEG, rng.normal(size=repeats) * 0.001 * G
        for i in range(rests):
            leaning = rooms[i, :, :2] @ tilt + C[i % 6][:, :2] @ square[i % 6]
            gyro[i] = rooms[i, 0] @ earth + bias_rr.mean()
            gyro[i] += rng.normal() * 0.003 * DEG / np.sqrt(60.0 * repeats)
            acc[i] = (
                G * (up[i] + leaning[0]) + acc_rr.mean() + rng.normal() * 1e-4 * G / np.sqrt(60.0 * repeats)
            )
        found["gyro.bias"].append(gyro.mean())
        found["accelerometer.bias"].append(0.5 * (acc[up > 0.5].mean() + acc[up < -0.5].mean()))
        slope = 0.5 * (acc[up > 0.5].mean() - acc[up < -0.5].mean()) / G - 1.0
        found["accelerometer.scale_factor"].append(slope + (rng.normal(size=repeats) * 2e-5).mean())
        angles = rng.normal(size=2) * 0.05 * DEG  # one way and the other, marks that do not change
        scale = (rng.normal(size=repeats) * 2e-5).mean()
        ways = [
            (angles[i] + rng.normal() * 0.003 * DEG * np.sqrt(20.0 / repeats)) / (2 * np.pi) for i in (0, 1)
        ]
        found["gyro.scale_factor"].append(np.mean(ways) + scale)
    return {name: np.array(values) for name, values in found.items()}


@pytest.mark.parametrize("repeats", [1, 4])
def test_what_is_left_is_what_a_simulated_store_leaves(repeats):
    left = sensor_left(ASKED, MODELS, repeats)
    errors = drawn_store(repeats, 1500, 5 + repeats)
    for name, error in errors.items():
        # the plain estimator weighs records alike, so ours may be a little better, never worse;
        # 1500 visits tell a sigma to 2 %
        actual, ours = np.std(error), left[name, "x"]
        assert ours <= 1.06 * actual, name
        assert ours >= 0.80 * actual, name


def test_misalignment_and_temperature_terms_are_not_renewed():
    more = [
        *MODELS,
        ErrorModel(
            "gyro.misalignment", "deg", 0.5 * DEG, ((float("nan"), 0.0),), 0.0, 0.002 * DEG, 0.5 * DEG, True
        ),
        ErrorModel("gyro.bias_temperature", "deg/s/K", 1e-5, ((float("nan"), 0.0),), 0.0, 1e-6, 1e-5, True),
    ]
    left = sensor_left(ASKED, more, 20)
    assert ("gyro.bias_temperature", "x") not in left
    assert left["gyro.misalignment", "xy"] > 0.5 * 0.1 * DEG  # the hand's axis is no better than the level


@settings(deadline=None, max_examples=15)
@given(rests=st.integers(1, 10), turns=st.integers(1, 10))
def test_more_power_ons_never_leave_more_and_always_take_longer(rests, turns):
    bench = StoreBench(ASKED, MODELS, small_basis().region)
    fewer, more = bench.left(rests, turns), bench.left(rests + 1, turns)
    seen = np.isfinite(fewer)
    assert np.all(more[seen] <= fewer[seen] * (1 + 1e-9))
    assert visit_time(ASKED, rests, turns) < visit_time(ASKED, rests + 1, turns)


def test_a_visit_takes_the_time_of_its_parts():
    asked = Recalibration(
        rest="100 s", move="10 s", turn="20 s", set_up="5 min", power_on="30 s", cool_down="70 s"
    )
    # set up 300; two power-ons 100 each; 12 rests of 110 twice; 6 turns of 30 once
    assert visit_time(asked, 2, 1) == pytest.approx(300 + 2 * 100 + 2 * 12 * 110 + 6 * 30)


def test_records_at_rest_and_turning_are_told_apart():
    records = store_records(ASKED)
    assert records.turning.sum() == 6
    assert np.linalg.norm(records.conditions.rate[records.turning > 0], axis=1) == pytest.approx(
        2 * np.pi / 20.0
    )


def test_published_reductions():
    """K 2.7: bias −70..80 %, scale factor −60..80 %; its table 2.19 has −86 % and −69..−80 %."""
    cut = 1 - published_check(ASKED) / np.array([p.before for p in published()])
    theirs = 1 - np.array([p.after for p in published()]) / np.array([p.before for p in published()])
    assert np.all(cut >= 0.70)
    # the accelerometer's scale factor is left with run-to-run here; the published unit keeps 0.025 %, for
    # which
    # the sources give no cause, so it is no target
    assert cut[:3] == pytest.approx(theirs[:3], abs=0.06)


# ---------------------------------------------------------------- schedules


def planner(limit: str = "11 m", period: float = 240.0, asked: Recalibration = ASKED) -> StorePlanner:
    basis = basis_of(loaded(with_limit(small(), "10 m")), None, quiet)
    wider = basis_of(loaded(with_limit(small(), limit)), None, quiet)
    region = replace(basis.region, constraints=wider.region.constraints)
    days = grid(period)
    growth = growth_of(region, basis.models, days, 0.95)
    return StorePlanner("u", region, growth, StoreBench(asked, basis.models, region), 0.95)


def test_without_visits_the_limit_lasts_as_long_as_the_plan_counted_on():
    """The plan's budget holds the storage of two months, so it lasts 60 days with all of it."""
    exact = planner("10 m")
    loads = exact.loads(exact.first)
    sixty = float(np.interp(60.0, exact.growth.days, loads))
    plan_load = exact.region.load(np.zeros(6), _whole(exact))
    assert sixty == pytest.approx(float(plan_load), rel=2e-3)  # linear between days of the grid


def _whole(one: StorePlanner):
    return reserve_of(one.region, np.ones((6, len(PARTS))))


def test_no_schedule_costs_less():
    """All sequences of visits on all days of a coarse grid, by brute force."""
    one = planner("9.2 m", 200.0)
    coarse = np.linspace(0.0, 200.0, 9)
    growth = growth_of(one.region, basis_of(loaded(small()), None, quiet).models, coarse, 0.95)
    one = StorePlanner("u", one.region, growth, one.bench, 0.95)
    numbers = (0, 1, 4)
    plan = one.schedule(numbers)
    choices = list(visits(ASKED, numbers))
    best = np.inf
    for count in range(4):
        for days in itertools.combinations(range(9), count):
            for made in itertools.product(choices, repeat=count):
                cost = sum(v.time_s for v in made)
                if cost < best and _holds(one, days, made):
                    best = cost
    assert plan.whole
    assert plan.proved
    assert 0 < len(plan.visits) <= 3
    assert plan.time_s == pytest.approx(best)


def _holds(one: StorePlanner, days, made) -> bool:
    state, load = one.first, one.loads(one.first)
    for place, visit in zip(days, made, strict=True):
        if np.any(load[: place + 1] > 1 + 1e-9):
            return False
        state = one.renewed(state, place, visit)
        load = np.where(np.arange(len(load)) >= place, one.loads(state), load)
    return bool(np.all(load <= 1 + 1e-9))


def test_a_schedule_keeps_every_limit_all_the_time():
    plan = planner("9.2 m", 365.0).schedule()
    assert plan.whole
    assert np.all(plan.load <= 1 + 1e-6)
    assert np.any(plan.without > 1)
    assert plan.time_s == pytest.approx(sum(v.visit.time_s for v in plan.visits))


def test_the_shortest_visit_is_the_shortest_of_all():
    one = planner("9.2 m", 120.0)
    due, end = one.last_within(one.first, 0), len(one.growth.days) - 1
    found = one.shortest(due, end)
    assert found.visit is not None
    for visit in visits(ASKED):
        if visit.time_s < found.visit.time_s:
            assert one.last_within(one.renewed(one.first, due, visit), due) < end


def test_a_generous_limit_needs_no_visit_and_a_tight_one_cannot_be_kept():
    assert planner("20 m", 365.0).schedule().visits == ()
    stuck = planner("7.8 m", 365.0, ASKED.model_copy(update={"repeats": 1})).schedule()
    assert not stuck.whole
    assert stuck.binding


# ---------------------------------------------------------------- the spec


def test_a_spec_that_says_nothing_is_refused():
    with pytest.raises(InputError, match="says nothing of recalibration"):
        recalibrate(loaded(small()), None, [], ForecastOptions(), quiet)


@pytest.mark.parametrize(
    ("part", "said"),
    [
        ({"rest": "5"}, "has no unit"),
        ({"rest": "5 deg"}, "wrong unit"),
        ({"rests": "5 min"}, "did you mean"),
        ({"turn": "0.5 s"}, "faster than a hand"),
        ({"period": "1 h"}, "shorter than a day"),
        ({"level": "20 deg"}, "nothing could be renewed"),
        ({"headings": 3}, "2"),
        ({"repeats": 0}, "1"),
    ],
)
def test_faults_of_the_section_are_explained(part, said):
    with pytest.raises(InputError, match=said) as caught:
        loaded(small(recalibration=part))
    assert all(f.line > 0 for f in caught.value.faults)


def test_a_spec_in_which_nothing_drifts_is_warned_of():
    spec = small(recalibration={"rest": "1 min"})
    for sensor in ("gyro", "accelerometer"):
        del spec["unit"][sensor]["bias"]["storage"]
    assert any("storage" in w.message for w in loaded(spec).warnings)
