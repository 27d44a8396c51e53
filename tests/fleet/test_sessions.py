"""Visits of a fleet on one calendar: the same visits, fewer days, every limit kept."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest

from planner.fleet.growth import growth_of
from planner.fleet.sessions import WorkingDays, on_one_calendar, session_time
from planner.fleet.store import StoreBench, Visit, visit_time
from planner.fleet.visits import StorePlanner, grid
from planner.pipelines.fleet import basis_of
from tests.fleet.fleets import DEG, G, small_basis
from tests.fleet.test_recalibration import ASKED, quiet
from tests.specs import loaded, small, with_limit


def fleet(units: int) -> list[StorePlanner]:
    """Units that drift alike but began with residuals of their own."""
    basis = basis_of(loaded(with_limit(small(), "10 m")), None, quiet)
    days = grid(365.0)
    rng = np.random.default_rng(5)
    found = []
    for u in range(units):
        growth = growth_of(basis.region, basis.models, days, 0.95)
        size = np.array([1e-4 * DEG] * 3 + [1e-4 * G] * 3) * rng.uniform(0, 1, 6)
        begun = type(growth)(growth.days, growth.start + size, growth.between)
        found.append(
            StorePlanner(f"u{u}", basis.region, begun, StoreBench(ASKED, basis.models, basis.region), 0.95)
        )
    return found


@pytest.mark.parametrize("asked", [ASKED, ASKED.model_copy(update={"units": 3})])
def test_units_come_together_and_keep_their_limits(asked):
    planners = fleet(5)
    plans = [p.schedule() for p in planners]
    working = WorkingDays(date(2026, 1, 5), frozenset(range(5)), 8 * 3600.0)
    moved, sessions = on_one_calendar(planners, plans, asked, working)
    for before, after in zip(plans, moved, strict=True):
        assert [v.visit for v in after.visits] == [v.visit for v in before.visits]
        assert after.whole
        assert all(b.day <= a.day + 1e-9 for a, b in zip(before.visits, after.visits, strict=True))
        assert np.all(after.load <= 1 + 1e-6)
    visits = sum(len(p.visits) for p in plans)
    assert sum(len(s.units) for s in sessions) == visits
    assert len(sessions) < visits
    assert all(s.time_s <= s.alone_s + 1e-9 for s in sessions)
    assert all(
        s.time_s <= 8 * 3600.0 and working.works(s.day) for s in sessions if s.fits and len(s.units) > 1
    )


def test_a_session_sets_up_once_and_rests_side_by_side():
    visit = Visit(2, 1, visit_time(ASKED, 2, 1))
    one = session_time(ASKED, [visit])
    assert one == pytest.approx(visit.time_s)
    assert session_time(ASKED, [visit, visit]) == pytest.approx(2 * visit.time_s - ASKED.set_up)
    both = ASKED.model_copy(update={"units": 2})
    spins = 6 * (ASKED.turns * ASKED.turn + ASKED.move)
    assert session_time(both, [visit, visit]) == pytest.approx(visit.time_s + spins)


def test_growth_starts_anew_at_a_visit():
    """After a visit there is nothing yet to add, and a later visit never leaves more."""
    from planner.fleet.drift import forecast_channels
    from planner.fleet.history import History, Series

    basis = small_basis()
    rng = np.random.default_rng(3)
    day = 7.0 * np.arange(15)
    value = 3e-5 * G * np.cumsum(rng.normal(size=15))
    series = Series("u", "accelerometer.bias", "x", "g", day, value, np.full(15, np.nan))
    models = {m.name: m for m in basis.models}
    channels, _, _ = forecast_channels(
        History((series,), "drawn"), models, day[-1] + 365, 0.95, "auto", "none", quiet, validated=False
    )
    days = grid(365.0, day[-1])
    sigma = np.full(6, 1e-4 * G)
    growth = growth_of(basis.region, basis.models, days, 0.95, channels, sigma)
    place = basis.region.index("accelerometer.bias", "x")
    after = growth.between[place, 1:]
    assert np.all(np.tril(after) == 0)
    assert np.all(np.diff(after, axis=0) <= 1e-15)  # by the day of the visit
    f = channels[0].at(days)
    whole = np.abs(f.mean) + f.half_width(0.95, measured=False)
    assert growth.start[place] + growth.between[place, 0] == pytest.approx(whole, rel=1e-9)
    better = growth_of(basis.region, basis.models, days, 0.95, channels, 0.1 * sigma).between[place, 1:]
    blind = growth_of(basis.region, basis.models, days, 0.95, channels).between[place, 1:]
    # what a visit teaches about the ageing counts, the more the better it measures
    assert better[40, -1] <= after[40, -1] < blind[40, -1]
