"""Sensors that do not scatter: zero is a value of every spread, for both methods and for verify."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from planner.pipelines.promise import FlightOptions, verify
from tests.verify.plans import Planned, flown, informed, planned_from

PARTS = ("run_to_run", "in_run", "storage")


def without(spec: dict[str, Any], *parts: str) -> dict[str, Any]:
    """The spec with parts of every error at zero."""
    unit = copy.deepcopy(spec["unit"])
    for budget in (b for sensor in ("gyro", "accelerometer") for b in unit[sensor].values()):
        budget.update({part: f"0 {budget['systematic'].split()[1]}" for part in parts})
    return spec | {"unit": unit}


def by_information() -> dict[str, Any]:
    """One requirement of the spec by information: where only the worst counts, flights take long."""
    return informed() | {"requirement": informed()["requirement"][:1]}


def recounted(one: Planned, flights: int = 0) -> Any:
    options = FlightOptions(flights=flights, through_files=min(flights, 1))
    return verify(one.loaded, one.document, options, lambda message: None)


@pytest.mark.parametrize("parts", [PARTS[:1], PARTS[:2], PARTS])
@pytest.mark.parametrize("made", [flown, by_information])
def test_a_plan_without_scatter_is_what_verify_counts(made, parts):
    found = recounted(planned_from(without(made(), *parts)))
    assert found.recount.ok, found.recount.faults[:5]


def test_units_without_scatter_go_the_whole_way_through_files():
    found = recounted(planned_from(without(by_information(), *PARTS)), flights=40)
    assert found.recount.ok
    assert found.files is not None


def test_what_does_not_scatter_takes_the_fewest_repeats():
    document = planned_from(without(flown(), *PARTS)).document
    assert {n for test in document["tests"] for n in test["repeats"]} == {2}
    assert all(a["parts"]["estimate"] == 0.0 for a in document["allowances"].values())


def test_a_perfect_sensor_over_days_leaves_the_walk():
    """Records without noise tell all of it but what walks after them, while other tests are made.

    Without a curve, of which a chamber that strays makes noise.
    """
    spec = without(by_information(), *PARTS[:2])
    for sensor in spec["unit"].values():
        sensor["bias"].pop("temperature_residual")
    spec["unit"]["noise"] = {"gyro": "0 deg/sqrt(h)", "accelerometer": "0 m/s/sqrt(h)"}
    left = planned_from(spec).document["allowances"]
    parts = left["gyro.bias"]["parts"]
    assert 0.0 <= parts["estimate"] < 0.02 * parts["storage"]
    later = left["gyro.scale_factor"]["parts"]
    assert 0.0 < later["estimate"] < 0.05 * later["storage"]
