"""Errors walk in store and stand while the unit is on: planned, counted again, by a dense least squares."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner import catalog
from planner.campaign.prior import walk_modes
from planner.nouns.array import Array
from planner.simulate.campaign import prepared, simulate
from planner.verify.records import records_of
from planner.verify.recount_promise import check_promise, covariance_of
from planner.verify.starts import anywhere
from tests.simulate.benches import campaign_of, noiseless
from tests.verify.plans import Planned, informed, planned_from, several
from tests.verify.test_recount_promise import prediction

STORED, RUN = np.radians(0.004), np.radians(0.003)  # of load_curve: SI over 60 days, and by power-on
DRIFT = np.radians(0.001)
SLOPE = 1e-6 / 9.80665  # 0.0001 %/g


def loaded() -> dict[str, Any]:
    """A load curve beside a scale factor over load: told only by differences within one power-on."""
    spec = several()
    gyro = {
        "bias": {"systematic": "0.03 deg/s", "in_run": "0.001 deg/s"},
        "load_curve": {"systematic": "0.3 deg/s", "run_to_run": "0.003 deg/s", "storage": "0.004 deg/s"},
        "scale_factor_acceleration": {"systematic": "0.02 %/g", "run_to_run": "0.0001 %/g"},
    }
    tests = {
        "loads": {
            "bench": "centrifuge",
            "calibrates": ["gyro.bias", "gyro.load_curve", "gyro.scale_factor_acceleration"],
            "motions": 48,
            "power_on": "30 s",
            "record": "20 s",
            "gap": "2 h",
            "temperatures": "room",
        }
    }
    return spec | {
        "name": "loaded",
        "requirement": [{"error": "position", "limit": "900 km", "rule": "rss"}],
        "unit": {"noise": {"gyro": "0 deg/sqrt(h)"}, "gyro": gyro},
        "effects": [*gyro],
        "benches": {"centrifuge": {"arm": "1.5 m", "limits": {"acceleration": "100 g"}}},
        "tests": tests,
        "plan": {"method": "information", "fixed": {"loads": {"temperatures": "room", "repeats": 3}}},
    }


@pytest.fixture(scope="module", name="one")
def _one() -> Planned:
    return planned_from(loaded())


def test_plan_and_recount_say_the_same_of_what_is_stored(one: Planned) -> None:
    p = prediction(one)
    assert [fault for f in check_promise(one.document, p) for fault in f.faults] == []


def left(one: Planned, day: Array, flight_day: float) -> Array:
    """(27,) sigma of what a dense least squares leaves of channel x in flight, by y = X θ + Z r, SI.

    All records at once, weighed by what a power-on draws and by the walk back from the last of their days.
    """
    records = records_of(one.document, one.loaded.spec)
    names = ["load_curve", "scale_factor_acceleration"]
    own = [catalog.effects()[n].regressors("gyro", records.conditions)[:, 0] for n in names]
    Z, S = (x[:, np.any(x, axis=0)] for x in own)
    X = np.column_stack([Z, S, np.ones(len(Z))])
    on = records.conditions.time_on
    drift = DRIFT**2 * np.exp(-np.abs(on[:, None] - on[None, :]) / 600.0)
    V = (RUN**2 * Z @ Z.T + SLOPE**2 * S @ S.T + drift) * (records.run[:, None] == records.run[None, :])
    ago = day.max() - day
    V = V + STORED**2 / 60.0 * (Z @ Z.T) * np.minimum.outer(ago, ago)
    estimate = np.linalg.inv(X.T @ np.linalg.solve(V, X))[: Z.shape[1], : Z.shape[1]]
    return np.asarray(np.sqrt(np.diag(estimate) + STORED**2 * (flight_day - day.max()) / 60.0))


def test_a_dense_least_squares_says_so_too(one: Planned) -> None:
    p = prediction(one)
    rows, parts = covariance_of(p, anywhere(p.e.spec), "cosines")
    mine = [i for i, (e, t) in enumerate(rows) if e[1] == "load_curve" and t.startswith("x")]
    counted = np.sqrt(np.diag(parts["storage"] + parts["estimate"])[mine])
    records = p.e.records
    began = np.array([records.conditions.day[records.run == r][0] for r in records.run])
    np.testing.assert_allclose(counted, left(one, began, p.e.day), rtol=0.01)
    # on the days of the records themselves, hours apart, the same few lines say otherwise
    assert np.max(left(one, records.conditions.day, p.e.day) / counted) > 1.02


def weeks() -> dict[str, Any]:
    """A unit that is on the bench on four Mondays and walks meanwhile by more than its power-ons differ."""
    spec = informed()
    for sensor, size in (("gyro", "0.004 deg/s"), ("accelerometer", "4 mg")):
        spec["unit"][sensor]["bias"]["storage"] = size
    for test in spec["tests"].values():
        test["attended"] = True
    shifts = {"days": ["mon"], "from": "08:00", "to": "10:30"}
    return spec | {"requirement": spec["requirement"][:1], "plan": spec["plan"] | {"shifts": shifts}}


def test_over_weeks_on_the_bench_plan_and_recount_agree() -> None:
    """One estimator for both: coefficients at the campaign's end, the walk until then among its unknowns."""
    made = planned_from(weeks())
    p = prediction(made)
    assert np.ptp(p.e.records.on_day) > 6.0
    assert [fault for f in check_promise(made.document, p) for fault in f.faults] == []


@settings(max_examples=30)
@given(days=st.lists(st.floats(0.0, 40.0), min_size=1, max_size=30))
def test_the_modes_of_a_walk_carry_it(days: list[float]) -> None:
    """Σ φ_k(D) φ_k(D') is min(D_end − D, D_end − D')/60, but for a fortieth of the whole."""
    day = np.array(days)
    modes = walk_modes(day)
    ago = day.max() - day
    np.testing.assert_allclose(
        modes @ modes.T, np.minimum.outer(ago, ago) / 60.0, atol=ago.max() / 60.0 / 15.0
    )
    assert np.trace(modes @ modes.T) >= 0.97 * ago.sum() / 60.0 - 1e-9
    assert np.allclose(modes[ago == 0.0], 0.0, atol=0.05 * np.sqrt(ago.max() / 60.0))


def test_units_stand_while_they_are_on() -> None:
    spec, design = campaign_of(temperatures=2, repeats=2)
    whole = prepared(spec)
    unit = replace(whole, budgets={e: b for e, b in whole.budgets.items() if e[1] == "bias"}, families={})
    walking = replace(noiseless(), storage=True, temperature_residual=False)
    table, still = (
        simulate(design, unit, 3, settings=s)[0] for s in (walking, replace(walking, storage=False))
    )
    walked = (table.acc - still.acc)[:, 2]
    each = [walked[table.run == run] for run in np.unique(table.run)]
    assert all(np.ptp(one) < 1e-9 * np.ptp(walked) for one in each)
    assert len({float(one[0]) for one in each}) == len(each)
