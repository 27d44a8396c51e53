"""The recommended date is late in at most 5 % of units, and not because it is absurdly early."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.errors import InputError
from planner.fleet.allowed_region import PARTS
from planner.fleet.dates import drifting_reserve, unit_dates
from planner.fleet.drift import forecast_channels
from planner.fleet.history import History, Series
from tests.fleet.fleets import DEG, G, drifting, small_basis

WEEKS, LATER = 26, 104
SCALE = {"gyro.bias": 0.0015 * DEG, "accelerometer.bias": 0.003 * G}


def fleet(units: int, seed: int, weeks: int = WEEKS, **kind) -> tuple[History, np.ndarray]:
    """A history of both biases, and the true residuals (units, weeks + later, 6) in the region's order."""
    rng = np.random.default_rng(seed)
    region = small_basis().region
    true = np.zeros((units, weeks + LATER, len(region.terms)))
    series = []
    for place, term in enumerate(region.terms):
        actual, seen = drifting(units, weeks, LATER, rng, **kind)
        true[:, :, place] = SCALE[term.error] * actual
        series += [
            Series(
                f"u{u:03d}",
                term.error,
                term.term,
                term.unit,
                7.0 * np.arange(weeks),
                SCALE[term.error] * seen[u, :weeks],
                np.full(weeks, np.nan),
            )
            for u in range(units)
        ]
    return History(tuple(series), "drawn"), true


def late_and_early(units: int, seed: int, method: str = "auto", **kind) -> tuple[float, float, int]:
    """Share of units late, median of (date − last value) / (true time left), number of dates."""
    basis = small_basis()
    weeks = kind.pop("weeks", WEEKS)
    history, true = fleet(units, seed, weeks, **kind)
    until = 7.0 * (weeks - 1 + LATER)
    models = {m.name: m for m in basis.models}
    channels, _, _ = forecast_channels(
        history, models, until, 0.95, method, "none", lambda m: None, validated=method != "auto"
    )
    dates = unit_dates(channels, basis.region, until, history.last_day, 0.95)
    reserve = drifting_reserve(basis.region, np.arange(len(basis.region.terms)))
    late, used = [], []
    for u, date in enumerate(dates):
        load = basis.region.load(true[u, weeks - 1 :], reserve)
        over = np.flatnonzero(load > 1.0)
        end = 7.0 * (weeks - 1 + (over[0] if len(over) else LATER))
        if date.outcome == "kept":
            late.append(len(over) > 0 and end < until)
            continue
        promised = date.day if date.day is not None else np.inf
        late.append(date.outcome == "date" and end < promised)
        if date.outcome == "date" and len(over):
            used.append((promised - history.last_day) / max(end - history.last_day, 1.0))
    return float(np.mean(late)), float(np.median(used)) if used else 0.0, len(used)


def test_dates_are_rarely_late():
    """A sample; hundreds of units are dated by benchmarks/bench_fleet.py."""
    late, used, count = late_and_early(80, 1, "local_trend")
    # three sigma of 5 % among 80 units
    assert late <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 80)
    assert count > 20
    assert used > 0.4  # of the time that there was


def test_dates_from_few_points_are_rarely_late():
    late, _, _ = late_and_early(40, 3, "local_trend", weeks=6)
    assert late <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 40)


def test_small_fleets_keep_the_promise():
    """Fleets of two units with 12 weeks of history."""
    late = np.mean([late_and_early(2, seed, "auto", weeks=12)[0] for seed in range(4)])
    # two of eight units late would have a probability of 6 % at a rate of 5 %
    assert late <= 0.25


def test_a_steady_drift_is_dated_where_the_line_meets_the_limit():
    """Without noise the date is that of a straight line, to the step of the grid."""
    basis = small_basis()
    region = basis.region
    place = region.index("accelerometer.bias", "x")
    day = 7.0 * np.arange(20)
    rate = 3e-5 * G
    series = Series("u", "accelerometer.bias", "x", "g", day, rate * day, np.full(20, np.nan))
    models = {m.name: m for m in basis.models}
    history = History((series,), "drawn")
    channels, _, _ = forecast_channels(history, models, 1000.0, 0.95, "local_trend", "none", lambda m: None)
    (date,) = unit_dates(channels, region, 1000.0, history.last_day, 0.95)
    reserve = drifting_reserve(region, np.array([place]))
    c = region.constraints[0]
    room = (c.limit - float(c.lengths @ reserve.sums)) / c.lengths[place]
    assert date.outcome == "date"
    step = 1.4 * (1000.0 - history.last_day) / 120  # the grid is densest at its beginning
    assert room / rate - 2 * step <= date.day <= room / rate
    assert date.terms[0][0] == "accelerometer.bias x"


def test_a_named_method_has_the_same_bands_wherever_it_is_asked():
    """Naive is too sure of units that drift; its bands are widened whether or not scores are shown."""
    basis = small_basis()
    history, _ = fleet(6, 5, drift=2.0)
    models = {m.name: m for m in basis.models}
    shown, plain = (
        forecast_channels(history, models, 400.0, 0.95, "naive", "none", lambda m: None, validated=validated)
        for validated in (True, False)
    )
    assert min(s.factor for s in shown[1]) > 1.1
    for a, b in zip(shown[0], plain[0], strict=True):
        np.testing.assert_array_equal(a.forecast.scale, b.forecast.scale)


def test_the_order_of_the_requirements_does_not_move_a_date():
    """The livelier half of the types is that of what the unit's limits feel, not of the first of them."""
    basis = small_basis()
    (c,) = basis.region.constraints
    deaf = replace(c, vectors=0.0 * c.vectors)
    history, _ = fleet(2, 3, 8)
    models = {m.name: m for m in basis.models}
    until = history.last_day + 700.0
    channels, _, _ = forecast_channels(
        history, models, until, 0.95, "auto", "none", lambda m: None, validated=False
    )
    days = [
        [
            u.day
            for u in unit_dates(
                channels, replace(basis.region, constraints=both), until, history.last_day, 0.95
            )
        ]
        for both in ((c, deaf), (deaf, c), (c,))
    ]
    assert None not in days[0]
    assert days[0] == days[1] == days[2]


def test_one_point_is_forecast_by_the_storage_of_the_spec():
    basis = small_basis()
    series = Series("u", "gyro.bias", "x", "deg/s", np.zeros(1), np.zeros(1), np.full(1, np.nan))
    channels, _, _ = forecast_channels(
        History((series,), "drawn"),
        {m.name: m for m in basis.models},
        120.0,
        0.95,
        "auto",
        "none",
        lambda m: None,
    )
    assert channels[0].method == "storage of the spec"
    # storage is what two months do
    assert np.interp(60.0, channels[0].ahead, channels[0].forecast.scale) == pytest.approx(
        0.001 * DEG, rel=1e-3
    )


def test_a_term_without_history_keeps_what_the_plan_left_it():
    region = small_basis().region
    reserve = drifting_reserve(region, np.array([0]))
    assert reserve.sums[1] == pytest.approx(region.parts[1].sum())
    lost = region.parts[0, [PARTS.index("estimate"), PARTS.index("storage")]].sum()
    assert reserve.sums[0] == pytest.approx(region.parts[0].sum() - lost)


def test_a_horizon_in_the_past_is_refused():
    with pytest.raises(InputError, match="before the last value"):
        unit_dates((), small_basis().region, 5.0, 5.0, 0.95)
