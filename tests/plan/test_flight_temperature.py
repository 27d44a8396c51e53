"""Effects that change with temperature by their own equation, from any start: as a flight there has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.sensor import ErrorName
from planner.plan.flight_response import flight_response
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.references import InitialAlignment
from tests.specs import loaded, small

RANGE = (-40.0, 65.0)
EVERY = slice(0, 9)
NAMES = (
    "gyro.g_sensitivity_temperature",
    "gyro.misalignment_temperature",
    "accelerometer.misalignment_temperature",
    "gyro.drift_curve_temperature",
    "accelerometer.drift_curve_over_temperature",
)
ALIGNED = InitialAlignment(self_aligned=True)


@pytest.fixture(scope="module", name="flight")
def _flight():
    one = loaded(small())
    return trajectory_of({"name": "turn", "duration": "30 s", "sampling_rate": "20 Hz"}, one.folder)


@pytest.mark.parametrize("name", NAMES)
def test_the_response_from_any_start_is_that_of_a_flight_which_is_so_warm(flight, name):
    requirement, errors = loaded(small()).spec.requirement, [ErrorName("gyro.bias"), ErrorName(name)]
    ours = flight_response(flight, errors, requirement, ALIGNED, RANGE)
    instants = range(len(ours.time_s))
    for degc in (-40.0, -27.3, 0.0, 20.0, 41.9, 65.0):
        warm = replace(flight, temperature_degc=np.full_like(flight.temperature_degc, degc))
        own = flight_response(warm, errors, requirement, ALIGNED)
        along = np.full((1, len(ours.moments)), degc)
        found = ours.started(along, instants, EVERY)[0]
        scale = max(float(np.abs(own.errors).max()), 1.0)
        np.testing.assert_allclose(found, own.errors, atol=1e-9 * scale)


def test_a_flight_that_warms_reads_each_moment_at_its_own_temperature(flight):
    """2 K between moments: the product of two straight lines over a moment is off by little of the whole."""
    t = flight.time_s
    warming = 10.0 * (t - t[0]) / (t[-1] - t[0])
    requirement, errors = loaded(small()).spec.requirement, [ErrorName(NAMES[0])]
    ours = flight_response(replace(flight, temperature_degc=20.0 + warming), errors, requirement, None, RANGE)
    own = flight_response(replace(flight, temperature_degc=-30.0 + warming), errors, requirement)
    along = ours.temperature_degc[None] - 50.0
    found = ours.started(along, [len(ours.time_s) - 1], EVERY)[0, 0].sum(axis=-1)
    wanted = own.errors[-1].sum(axis=-1)
    np.testing.assert_allclose(found, wanted, atol=1e-3 * np.abs(wanted).max())


def test_other_errors_have_one_response_for_all_starts(flight):
    ours = flight_response(flight, [ErrorName("gyro.bias")], loaded(small()).spec.requirement, None, RANGE)
    along = np.array([[-40.0] * len(ours.moments), [65.0] * len(ours.moments)])
    assert ours.started(along, [0], EVERY).shape[0] == 1
