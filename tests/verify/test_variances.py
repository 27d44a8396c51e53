"""Variances at many starts at once against whole covariances of one flight after the other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from planner.nouns.array import Array
from planner.verify.asked import covariances
from planner.verify.prediction import Prediction
from planner.verify.second_moments import Moment, mean_of
from planner.verify.starts import anywhere
from planner.verify.variances import AtStarts
from tests.verify.plans import planned_from
from tests.verify.test_recount_promise import prediction
from tests.verify.test_warm_effects import warm

FAMILIES = ("cosines", "kink")


def warming() -> dict[str, Any]:
    """A flight that warms, power-ons that forget their draw over temperature, thermometers that err.

    Beside errors whose columns are the same at all starts one that changes with temperature by its equation.
    """
    spec = warm()
    gyro = spec["unit"]["gyro"]["bias"]
    gyro = gyro | {"run_to_run": {"value": "0.001 deg/s", "temperature_correlation": "20 K"}}
    bench = spec["benches"]["rate_table"] | {"accuracy": {"temperature": "0.3 K", "level": "0.02 deg"}}
    wanted = [r | {"at": "any"} for r in spec["requirement"]]
    return spec | {
        "requirement": wanted,
        "unit": spec["unit"] | {"gyro": spec["unit"]["gyro"] | {"bias": gyro}},
        "trajectory": spec["trajectory"] | {"temperature": {"start": "0 degC", "end": "25 degC"}},
        "benches": {"rate_table": bench},
        "plan": spec["plan"] | {"temperature_estimator": "smooth"},
    }


@pytest.fixture(scope="module", name="p")
def _p() -> Prediction:
    return prediction(planned_from(warming()))


@pytest.mark.parametrize("index", [0, 1])
def test_they_are_the_diagonals_of_the_covariances(p: Prediction, index: int) -> None:
    starts = anywhere(p.e.spec).along(p.profile, np.linspace(*p.e.spec.plan.temperatures.range, 5))
    at = AtStarts(p.asked[index], p.foresight, starts)
    for family in FAMILIES:
        moments = p.curves.moments(family)
        whole = covariances(at.asked, at.seen, {family: moments})[family]
        found = at.variances(family, moments)
        assert found == pytest.approx(np.diagonal(whole, axis1=1, axis2=2), rel=1e-9)


def test_what_is_kept_is_of_no_campaign(p: Prediction) -> None:
    """Another campaign's variances are the same whether or not a first one left its own."""
    starts = anywhere(p.e.spec).along(p.profile, np.array([0.0, 20.0]))
    moments = p.curves.moments("kink")
    noisier = replace(
        p.foresight, estimates=replace(p.foresight.estimates, noise=p.foresight.estimates.noise * 2)
    )
    known = AtStarts(p.asked[0], noisier, starts).variances("kink", moments)
    fresh = AtStarts(replace(p.asked[0], kept={}), noisier, starts).variances("kink", moments)
    assert np.array_equal(known, fresh)


def _moment(grid: Array, seed: int) -> Moment:
    rows = np.random.default_rng(seed).normal(size=(3, len(grid)))
    return Moment(grid, rows.T @ rows)


def test_many_temperatures_are_looked_at_on_the_grid() -> None:
    """Beyond the grid too, where its end segments go on."""
    moment = _moment(np.linspace(-10.0, 30.0, 9), 1)
    rng = np.random.default_rng(2)
    rows, degc = rng.normal(size=(2, 4, 50)), rng.uniform(-15.0, 35.0, size=50)
    wanted = np.einsum("trk,kl,tsl->rs", rows, moment.at(degc), rows)
    assert moment.through(rows, degc) == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.abs(wanted).max())
    assert moment.squares(rows, degc) == pytest.approx(np.diag(wanted), rel=1e-9)
    few = rows[:, :, :2], degc[:2]
    assert moment.squares(*few) == pytest.approx(np.diag(moment.through(*few)), rel=1e-12)


def test_a_mean_of_moments_is_of_each_temperature() -> None:
    several = [_moment(np.linspace(0.0, 10.0, n), seed) for seed, n in enumerate((5, 9, 5))]
    one, other = np.array([1.0, 4.0, 7.0]), np.array([2.0, 9.0])
    found = mean_of(several)
    assert len(found) == 2
    wanted = np.mean([m.between(one, other) for m in several], axis=0)
    assert sum(m.between(one, other) for m in found) == pytest.approx(wanted, rel=1e-12)


def test_what_estimates_are_misled_by_is_the_same_whatever_was_asked_before(p: Prediction) -> None:
    starts = anywhere(p.e.spec).along(p.profile, np.array([0.0, 20.0]))
    moments = p.curves.moments("kink")
    first = p.foresight.misread(moments).copy()
    for _ in range(2):
        AtStarts(p.asked[0], p.foresight, starts).variances("kink", moments)
        p.foresight.told(moments)
    assert np.any(first != 0.0)
    assert np.array_equal(p.foresight.misread(moments), first)
    assert np.array_equal(replace(p.foresight).misread(moments), first)
