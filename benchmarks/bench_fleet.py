"""Units after the campaign: accept 1000 units, forecast 1000 channels of 100 weeks, and is it right?

First the answers: error rates of accept on the limit, coverage of the 95 % intervals on fleets with known
drift, how often a date is late; then the times, beside those of statsmodels for the same forecasts.

    python benchmarks/bench_fleet.py            # one to two minutes
    python benchmarks/bench_fleet.py --study  # more units and seeds; small fleets
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from planner.fleet.acceptance import accepted
from planner.fleet.check_groups import by_temperature
from planner.fleet.check_residual import check_residuals
from planner.fleet.drift import forecast_channels
from planner.fleet.forecast._method import Forecast, Past
from planner.fleet.history import History, Series
from planner.fleet.judge import ErrorRates
from planner.fleet.validation import method_named
from tests.fleet.fleets import check_table, drifting, small_basis
from tests.fleet.test_dates import late_and_early
from tests.fleet.test_judge import batch

T = TypeVar("T")
WEEK = 7.0
RATES = ErrorRates(0.05, 0.05)


def timed(work: Callable[[], T]) -> tuple[T, float]:
    start = time.perf_counter()
    answer = work()
    return answer, time.perf_counter() - start


def accept_units(load: float, count: int, seed: int) -> tuple[dict[str, float], float]:
    """Shares of the verdicts of units whose true load is `load`, and the seconds that judging them took."""
    basis = small_basis()
    table = check_table(*batch(load, count, seed), np.random.default_rng(seed))

    def judge() -> list[str]:
        found = check_residuals(table, by_temperature(table), basis.models, basis.region)
        return [u.verdict for u in accepted(found, basis.region, (-60.0, 60.0), RATES)]

    verdicts, seconds = timed(judge)
    return {v: verdicts.count(v) / count for v in ("accepted", "rejected", "undecided")}, seconds


def study_accept(count: int) -> None:
    print(f"\naccept, {count} units of 6 terms, 3 temperatures, 6 power-ons each (108 records a unit)")
    for load in (0.8, 0.9, 1 - 1e-9, 1 + 1e-9, 1.1, 1.2):
        shares, seconds = accept_units(load, count, 7)
        told = ", ".join(f"{v} {100 * s:5.1f} %" for v, s in shares.items())
        print(f"  true load {load:.9f}: {told}   {seconds:.2f} s")
        wrong = shares["accepted"] if load > 1 else shares["rejected"]
        assert wrong <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / count), "an error rate is not kept"


def study_coverage(units: int) -> None:
    print(f"\ncoverage of 95 % intervals, {units} channels each: 1, 4 and 13 weeks ahead")
    ahead, leads = np.array([7.0, 28.0, 91.0]), np.array([1, 4, 13])
    every = []
    for weeks in (4, 5, 8, 14, 26, 52, 100):
        for walk in (0.0, 0.05, 0.3):
            _, seen = drifting(units, weeks, 13, np.random.default_rng(weeks), walk=walk)
            past = [Past("k", WEEK * np.arange(weeks), y[:weeks], np.full(weeks, np.nan)) for y in seen]
            made = method_named("local_trend").forecast(past, [ahead] * units)
            inside = np.mean(
                [
                    np.abs(y[weeks - 1 + leads] - f.mean) <= f.half_width(0.95)
                    for f, y in zip(made, seen, strict=True)
                    if isinstance(f, Forecast)
                ],
                axis=0,
            )
            every.append(inside)
            shown = " ".join(f"{100 * x:5.1f}" for x in inside)
            print(f"  {weeks:3d} weeks, random walk {walk:4.2f} a week: {shown} %")
    assert np.all(np.abs(np.array(every) - 0.95) <= 0.03), "coverage leaves 95 % ± 3"


def study_dates(units: int, seeds: int) -> None:
    print("\ndates: share of units late, median of the time used, local_trend on a fleet")
    for weeks in (6, 12, 26):
        found = [late_and_early(units, seed, "local_trend", weeks=weeks) for seed in range(seeds)]
        late = float(np.mean([f[0] for f in found]))
        count = units * seeds
        used = np.mean([f[1] for f in found])
        print(
            f"  {weeks:2d} weeks: {100 * late:4.1f} % of {count} late, {100 * used:3.0f} % of the time used"
        )
        assert late <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / count), "too many dates are late"


def study_small_fleets(fleets: int, weeks: int, units: int) -> None:
    late = [late_and_early(units, 100 + seed, "auto", weeks=weeks)[0] for seed in range(fleets)]
    share, count = float(np.mean(late)), fleets * units
    print(f"  {fleets} fleets of {units}, method chosen in each, {weeks} weeks: {100 * share:4.1f} % late")
    assert share <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / count), "too many dates are late"


def bench_forecast(channels: int, weeks: int) -> None:
    print(f"\nforecast, {channels} channels of {weeks} weeks, one year ahead")
    _, seen = drifting(channels, weeks, 13, np.random.default_rng(1))
    past = [Past("k", WEEK * np.arange(weeks), y[:weeks], np.full(weeks, np.nan)) for y in seen]
    ahead = [np.linspace(3.0, 365.0, 120)] * channels
    ours, seconds = timed(lambda: method_named("local_trend").forecast(past, ahead))
    few = 10
    method_named("structural").forecast(past[:1], ahead[:1])  # its packages are loaded
    theirs, each = timed(lambda: method_named("structural").forecast(past[:few], ahead[:few]))
    apart = [
        np.abs(a.mean - b.mean) / a.half_width(0.95)
        for a, b in zip(ours[:few], theirs, strict=True)
        if isinstance(a, Forecast) and isinstance(b, Forecast)
    ]
    assert len(apart) == few
    assert np.median(apart) < 0.2, "the two implementations disagree"
    print(f"  local_trend {seconds:.2f} s; statsmodels {each / few * channels:.0f} s (from {few} channels)")
    print(f"  means apart by {100 * float(np.median(apart)):.1f} % of the interval (median)")
    series = tuple(
        Series(f"u{i // 6:03d}", "gyro.bias", "xyz"[i % 3], "deg/s", p.day, p.value, p.sigma)
        for i, p in enumerate(past)
    )
    until = WEEK * weeks + 365.0
    quiet: Callable[[str], None] = lambda message: None  # noqa: E731 - a def would take three lines to do nothing
    whole, total = timed(
        lambda: forecast_channels(History(series, "drawn"), {}, until, 0.95, "auto", "none", quiet)
    )
    best = [s for s in whole[1] if s.recommended]
    assert best[0].method in ("local_trend", "hierarchical")
    assert abs(best[0].coverage - 0.95) <= 0.03
    print(f"  with rolling origins of all five methods {total:.1f} s; recommended: {best[0].method}")
    print(f"  its held-out coverage {100 * best[0].coverage:.1f} % of {best[0].cases} values")
    for s in whole[1]:
        print(
            f"    {s.method:17s} rms {s.rmse / s.naive_rmse:5.2f} of naive, inside {100 * s.coverage:5.1f} %"
        )


def main() -> None:
    study = "--study" in sys.argv
    study_accept(4000 if study else 1000)
    study_coverage(6000 if study else 1500)
    study_dates(300, 4 if study else 1)
    if study:
        print("\nsmall fleets")
        for weeks, units in ((26, 1), (12, 1), (26, 4)):
            study_small_fleets(60 // units, weeks, units)
    bench_forecast(1000, 100)


if __name__ == "__main__":
    main()
