"""A plan that rests on tests which do not list what they tell says so, and only then."""

from __future__ import annotations

from typing import Any

import yaml

from planner.information.borrowed import borrowed, borrowed_notes
from planner.information.choose import campaign_found
from tests.information import cases
from tests.specs import SHIPPED

AT_REST = ["gyro.bias", "accelerometer.bias", "accelerometer.scale_factor"]
TURNING = ["gyro.scale_factor"]
ONCE = {"temperatures": 1, "repeats": 2}
OFTEN = {"temperatures": 4, "repeats": 2}


def told(static: dict[str, int], rates: dict[str, int], listed: list[str]) -> dict[str, float]:
    """Error -> growth without the tests that do not list it; a campaign by hand of the loop's two tests."""
    tree: dict[str, Any] = yaml.safe_load((SHIPPED / "close_the_loop.yaml").read_text(encoding="utf-8"))
    tree["trajectory"] = cases.TRAJECTORIES["level"]
    tree["tests"]["rates"]["calibrates"] = listed
    tree["plan"]["fixed"] = {"static": static, "rates": rates}
    flight = cases.flight(tree)
    found = campaign_found(flight)
    notes = borrowed_notes(flight.spec, found)
    errors = {one.error: one.growth for one in borrowed(flight.spec, found)}
    assert len(notes) == bool(errors)
    assert all(error in notes[0] for error in errors)
    assert all("rates 240 s, static 1020 s" in note for note in notes)
    return errors


def test_biases_over_temperature_from_the_turning_table_are_borrowed() -> None:
    found = told(ONCE, OFTEN, TURNING)
    assert set(found) == {"gyro.bias", "accelerometer.bias"}
    assert all(2.0 <= growth < 100.0 for growth in found.values())


def test_what_is_listed_is_not_borrowed() -> None:
    assert told(ONCE, OFTEN, [*TURNING, *AT_REST]) == {}


def test_a_test_that_tells_its_errors_well_needs_no_note() -> None:
    assert told(OFTEN, ONCE, TURNING) == {}
