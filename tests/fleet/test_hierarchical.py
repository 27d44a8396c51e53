"""One model of the type of unit: what the spec says fades, units teach each other, intervals hold."""

from __future__ import annotations

import numpy as np
import pytest

from planner.fleet.forecast._method import Past
from planner.fleet.forecast.hierarchical import Hierarchical

WEEK = 7.0
AHEAD = np.array([7.0, 28.0, 91.0])


def drawn(
    weeks: int, seed: int, channels: int = 90, *, walk: float = 0.4, slope: float = 0.2, noise: float = 0.1
):
    """Past and truth at the leads, storage 1: a walk, an ageing of each channel's own, noise."""
    rng = np.random.default_rng(seed)
    days = np.arange(int(WEEK * weeks) + 92)
    true = np.cumsum(walk / np.sqrt(60) * rng.normal(size=(channels, len(days))), axis=1)
    true += slope * rng.normal(size=(channels, 1)) * days / 60
    day = WEEK * np.arange(weeks)
    seen = true[:, day.astype(int)] + noise * rng.normal(size=(channels, weeks))
    past = [Past("gyro.bias", day, y, np.full(weeks, np.nan), 1.0) for y in seen]
    last = int(day[-1])
    return past, true[:, last + AHEAD.astype(int)]


@pytest.mark.parametrize("weeks", [3, 8, 30])
def test_intervals_cover_what_they_promise(weeks):
    """Three fleets of 90 channels; thousands of units in benchmarks/study_fleet_dates.py."""
    inside, size = [], []
    for seed in range(3):
        past, later = drawn(weeks, 10 * weeks + seed)
        made = Hierarchical().forecast(past, [AHEAD] * len(past))
        half = np.array([f.half_width(0.95, measured=False) for f in made])
        inside.append(np.abs(later - np.array([f.mean for f in made])) <= half)
        size.append(half)
    # leads of a channel go together: three sigma of 270 channels, and a prior that still shows at three weeks
    assert np.mean(inside) == pytest.approx(0.95, abs=0.04)
    assert np.median(np.array(size)[..., 1]) < 1.5


def test_the_third_point_does_not_destroy_what_two_and_the_spec_say():
    """133 days from two points, 3 from three was once the answer: half-widths go on evenly."""
    rng = np.random.default_rng(4)
    y = np.cumsum(0.3 * rng.normal(size=6))
    half = []
    for n in range(2, 7):
        one = Past("accelerometer.bias", WEEK * np.arange(n), y[:n], np.full(n, np.nan), 1.0)
        (made,) = Hierarchical().forecast([one], [np.array([60.0])])
        half.append(made.half_width(0.95, measured=False)[0])
    ratio = np.array(half[1:]) / np.array(half[:-1])
    assert np.all(ratio < 2.0)
    assert np.all(ratio > 0.5)


def test_units_teach_each_other():
    """Three points of one channel tell little of its walk; those of ninety tell it."""
    past, _ = drawn(4, 7, slope=0.0, walk=0.1, noise=0.02)
    alone = Hierarchical().forecast(past[:1], [AHEAD])[0].half_width(0.95, measured=False)
    together = Hierarchical().forecast(past, [AHEAD] * len(past))[0].half_width(0.95, measured=False)
    assert together[1] < 0.7 * alone[1]


def test_what_the_spec_says_fades():
    """A storage of the spec that is ten times too large is forgotten at eight weeks of a fleet."""
    past, _ = drawn(8, 3, slope=0.0)
    wrong = [Past(p.kind, p.day, p.value, p.sigma, 10.0) for p in past]
    right, other = (
        np.median([f.half_width(0.95, measured=False)[1] for f in Hierarchical().forecast(p, [AHEAD] * 90)])
        for p in (past, wrong)
    )
    assert other < 1.5 * right


def test_scaling_the_values_scales_the_forecast():
    past, _ = drawn(10, 5, 12)
    scaled = [Past(p.kind, p.day, 1e-3 * p.value, p.sigma, 1e-3) for p in past]
    for a, b in zip(
        Hierarchical().forecast(past, [AHEAD] * 12),
        Hierarchical().forecast(scaled, [AHEAD] * 12),
        strict=True,
    ):
        assert b.mean == pytest.approx(1e-3 * a.mean, rel=1e-6, abs=1e-9)
        assert b.scale == pytest.approx(1e-3 * a.scale, rel=1e-6)


def test_without_a_storage_three_values_are_needed():
    day = WEEK * np.arange(2)
    (said,) = Hierarchical().forecast([Past("k", day, day, np.full(2, np.nan))], [AHEAD])
    assert "the spec's storage" in said
