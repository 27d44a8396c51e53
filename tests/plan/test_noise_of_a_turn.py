"""White noise of sensors that turn with the body, and drift that forgets fast, as `verify` counts them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from planner.information.model_of import flight_of
from planner.nouns.sensor import ErrorName
from planner.pipelines.promise import FlightOptions, verify
from planner.plan import flight_response as response
from planner.plan.spec_to_trajectory import trajectory_of
from tests.specs import loaded
from tests.verify.plans import informed, planned_from

TURN = {"name": "turn", "duration": "400 s", "bank": "58 deg", "sampling_rate": "20 Hz"}


def turning(**bias: Any) -> dict[str, Any]:
    """Ten turns in 400 s, with gyros of which hardly anything but the noise is felt."""
    spec = informed() | {"name": "turning", "trajectory": TURN}
    for sensor in spec["unit"].values():
        for budget in sensor.values():
            budget.pop("in_run", None)
    spec["unit"]["gyro"]["bias"] |= {"run_to_run": "0.1 deg/h", "storage": "0.1 deg/h"} | bias
    spec["unit"]["gyro"]["bias"]["temperature_residual"] = {1: "0.1 deg/h", "curve": "kink"}
    spec["unit"]["noise"] = {"gyro": "0.5 deg/sqrt(h)", "accelerometer": "50 ug/sqrt(Hz)"}
    wanted = [{"error": "attitude", "limit": "10 deg", "rule": "rss"}]
    wanted += [{"error": "position", "limit": "100 km", "rule": "rss"}]
    return spec | {"requirement": wanted}


def test_noise_is_the_same_however_finely_time_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """Along the axes of the body a response turns round within a box, and most of the noise was lost."""
    source = loaded(turning())
    flight = trajectory_of(source.spec.trajectory, source.folder)
    found = []
    for least in (response.BOXES, 40 * response.BOXES):
        monkeypatch.setattr(response, "BOXES", least)
        monkeypatch.setattr(response, "MOST_BOXES", 40 * response.MOST_BOXES)
        one = response.flight_response(flight, [ErrorName("gyro.bias")], source.spec.requirement)
        found.append(np.einsum("masb,masb->mas", one.white, one.white)[-1])
    coarse, fine = found
    np.testing.assert_allclose(np.sqrt(coarse), np.sqrt(fine), rtol=0.01, atol=1e-6 * np.sqrt(fine.max()))


@pytest.mark.parametrize("drift", [{}, {"in_run": {"value": "2 deg/h", "correlation_time": "20 s"}}])
def test_a_turn_is_promised_what_is_counted_again(drift: dict[str, Any]) -> None:
    one = planned_from(turning(**drift))
    options = FlightOptions(flights=0, through_files=0)
    found = verify(one.loaded, one.document, options, lambda message: None)
    assert found.recount.ok, found.recount.faults[:5]


def test_moments_follow_the_drift_that_forgets_fastest() -> None:
    source = loaded(turning(in_run={"value": "2 deg/h", "correlation_time": "20 s"}))
    moments = flight_of(source.spec, trajectory_of(source.spec.trajectory, source.folder)).response.moments
    assert np.diff(moments).max() <= 10.0
