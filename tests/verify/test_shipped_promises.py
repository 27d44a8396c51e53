"""The shipped specs keep their promise: planned, counted again, flown."""

from __future__ import annotations

import json

import pytest

from planner.export.json import plan_text
from planner.pipelines.sweep import _plan
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.load import load_spec
from planner.verify.experiment import experiment
from planner.verify.monte_carlo import fly
from planner.verify.outcome import outcomes
from planner.verify.recount import recount
from planner.verify.weak import weak_coefficients
from planner.verify.workers import here
from tests.specs import SHIPPED

FLIGHTS = 200  # one of them outside still leaves the interval of the share above 97 %


@pytest.mark.parametrize(
    "name",
    [
        "close_the_loop",
        "helicopter",
        "published_optimum",
        "small_uav",
        "tactical_leg",
        pytest.param(
            "high_g",
            marks=pytest.mark.xfail(
                reason="one rate, and loads along x alone, do not tell the declared effects of load apart"
            ),
        ),
    ],
)
def test_the_promise_is_kept(name):
    loaded = load_spec(SHIPPED / f"{name}.yaml")
    document = json.loads(plan_text(_plan(loaded)))
    trajectory = trajectory_of(loaded.spec.trajectory, loaded.folder)
    found = recount(document, loaded, trajectory)
    assert found.ok, found.faults[:5]
    e = experiment(document, loaded.spec, trajectory, seed=1)
    flown = fly(e, FLIGHTS, here, lambda message: None)
    verdicts = {
        o.error: (o.verdict, o.share, o.too_small) for o in outcomes(e, flown.tally, document, loaded.spec)
    }
    assert {v[0] for v in verdicts.values()} == {"kept"}, (verdicts, weak_coefficients(e))
