"""A height aid in plan and verify: planned, counted again, flown, and said where it is missing."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from planner.errors import InfeasibleError
from planner.pipelines.promise import FlightOptions, verify
from tests.specs import loaded, planned
from tests.verify.plans import Planned, informed, planned_from

AIDED = {"aided": "90 m"}


def aided(**changes: Any) -> dict[str, Any]:
    """Height and position at the end, by hand; the aid's own error is a large part of both."""
    rule = {"percentile": "90 %"}
    wanted = [
        {"error": "position", "limit": "300 m", "rule": rule},
        {"error": "up", "limit": "150 m", "rule": "rss"},
    ]
    unit = copy.deepcopy(informed()["unit"])
    for sensor in ("gyro", "accelerometer"):
        unit[sensor]["bias"]["temperature_residual"]["curve"] = "kink"
    made = {"name": "aided", "requirement": wanted, "vertical": AIDED, "unit": unit}
    return informed() | made | changes


@pytest.fixture(scope="module", name="made")
def _made() -> Planned:
    return planned_from(aided())


def test_the_aid_is_all_that_is_left_of_height(made):
    up = made.document["requirements"][1]
    assert up["achieved"] == pytest.approx(90.0, rel=1e-6)
    assert (
        made.document["requirements"][0]["achieved"] > 1.6 * 90.0
    )  # 90 % of |height| alone are within 148 m


def test_verify_counts_and_flies_the_same(made):
    options = FlightOptions(flights=200, through_files=0)
    found = verify(made.loaded, made.document, options, lambda message: None)
    assert found.recount.ok, found.recount.faults[:5]
    said = {r["error"]: r["achieved"] for r in made.document["requirements"]}
    flown = {o.error: o for o in found.outcomes}
    assert 0.85 < flown["up"].rms / said["up"] < 1.15  # three standard errors of 200 flights
    assert 0.83 < flown["position"].at_promise / said["position"] < 1.17
    assert any(part.part == "height" for part in flown["up"].parts)


def test_it_may_stand_in_the_trajectory(made):
    flight = made.loaded.spec.trajectory
    assert isinstance(flight, dict)
    inside = aided(trajectory=flight | {"vertical": AIDED})
    del inside["vertical"]
    assert planned_from(inside).document["requirements"] == made.document["requirements"]


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ({"trajectory": {"name": "level", "vertical": AIDED}}, "keep one"),
        ({"vertical": {"aided": "-1 m"}}, "greater than or equal to 0|less than 0"),
        ({"vertical": {"aided": "3 deg"}}, "m"),
        ({"vertical": {}}, "aided"),
    ],
)
def test_what_is_wrong_is_said(written, said):
    from planner.errors import InputError

    with pytest.raises(InputError) as error:
        loaded(aided(**written))
    assert any(f.path.startswith(("vertical", "trajectory.vertical")) for f in error.value.faults)


def test_a_long_flight_without_an_aid_says_what_becomes_of_it():
    long = {"name": "level", "duration": "40 min", "sampling_rate": "10 Hz"}
    free = aided(trajectory=long, requirement=[{"error": "up", "limit": "10 m", "rule": "rss"}])
    del free["vertical"]
    free["plan"] = free["plan"] | {"fixed": {}, "repeats": {"least": 2, "most": 3}}
    assert any("nothing holds the height" in w.message for w in loaded(free).warnings)
    with pytest.raises(InfeasibleError, match="nothing holds the height"):
        planned(free)
    assert not any("height" in w.message for w in loaded(free | {"vertical": AIDED}).warnings)
