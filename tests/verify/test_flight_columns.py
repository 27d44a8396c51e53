"""Columns of a flight that act a few at a time: the same as all of them, and few however long it flies."""

from __future__ import annotations

import copy
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner import catalog
from planner.plan.spec_to_trajectory import trajectory_of
from planner.verify.experiment import Experiment, experiment
from planner.verify.flight_columns import Columns
from planner.verify.flights import part_coefficients
from tests.specs import loaded
from tests.verify.plans import flown, plan_of

MINUTES = 5


@cache
def long_flight() -> Experiment:
    """Noise, a self-alignment, an error that is neither constant nor proportional; five minutes."""
    spec = copy.deepcopy(flown())
    spec["trajectory"] = {"name": "turn", "duration": f"{60 * MINUTES} s", "sampling_rate": "10 Hz"}
    spec["initial_alignment"] = {"heading": "0.5 deg", "self_aligned": True}
    spec["unit"]["noise"] = {"gyro": "0.3 deg/sqrt(h)", "accelerometer": "0.06 m/s/sqrt(h)"}
    spec["unit"]["gyro"]["g_sensitivity"] = {"systematic": "0.001 deg/s/g", "run_to_run": "0.0003 deg/s/g"}
    one = loaded(spec)
    trajectory = trajectory_of(one.spec.trajectory, one.folder)
    return experiment(plan_of("flown").document, one.spec, trajectory, seed=5)


def sides(columns: Columns, start: int, stop: int) -> np.ndarray:
    """(n, 3, active) of both sensors."""
    return np.concatenate([x for side in columns.forcing(start, stop) for x in side], axis=2)


@settings(max_examples=40)
@given(data=st.data())
def test_what_acts_is_what_all_columns_have_there(data):
    columns = long_flight().flight.columns
    n = len(columns.trajectory.angle_increment)
    start = data.draw(st.one_of(st.just(0), st.integers(0, n - 2)))
    stop = data.draw(st.integers(start + 1, n))
    every = sides(columns, 0, n)[start:stop]
    acting = columns.active(start, stop)
    assert every.shape[2] == columns.count
    np.testing.assert_allclose(sides(columns, start, stop), every[:, :, acting], atol=1e-12)
    idle = np.setdiff1d(np.arange(columns.count), acting)
    assert not every[:, :, idle].any()


def test_few_columns_act_in_any_minute():
    columns = long_flight().flight.columns
    minute = 600
    most = max(len(columns.active(s, s + minute)) for s in range(0, MINUTES * minute - minute, 97))
    assert most < columns.count / 2


@pytest.mark.parametrize("error", [("gyro", "bias"), ("gyro", "g_sensitivity"), ("accelerometer", "bias")])
def test_responses_are_what_one_of_each_value_does(error):
    """Through the columns' coefficients, self-alignment included."""
    flight = long_flight().flight
    rows = np.random.default_rng(1).normal(size=(4, flight.columns.count))
    K, t = len(flight.moments), len(catalog.effects()[error[1]].terms(error[0]))
    one = np.eye(K * t).reshape(-1, K, t)
    wanted = (rows @ part_coefficients(flight, *error, one).T).reshape(4, K, t)
    np.testing.assert_allclose(flight.columns.responses(rows, *error), wanted, atol=1e-12)


def test_an_error_that_does_not_fly_has_no_columns():
    with pytest.raises(ValueError, match="is not among the columns"):
        long_flight().flight.columns.responses(np.zeros((1, 1000)), "accelerometer", "g_squared_sensitivity")
