"""A spec that says nothing of noise: its records are no better than those that `simulate` and `verify` make.

Records without any noise tell a scale factor at rest, by the Earth's rate, and the turns that would tell it
are left out: 282.6 m had been promised of a foreign spec, and 334.6 flew.
"""

from __future__ import annotations

from typing import Any

import pytest

from planner.pipelines.promise import FlightOptions, verify
from planner.protocols import SENSORS
from planner.simulate.settings import settings_of
from planner.spec.model import Unit
from planner.verify.chance import chance_of
from tests.specs import loaded
from tests.verify.plans import flown, planned_from

NOISE = {"gyro": "0.003 deg/s/sqrt(Hz)", "accelerometer": "100 micro-g/sqrt(Hz)"}
NONE = {"gyro": "0 deg/s/sqrt(Hz)", "accelerometer": "0 micro-g/sqrt(Hz)"}  # a word is a word


def at_rest(noise: dict[str, str] | None) -> dict[str, Any]:
    """Rests alone: of the gyros' scale factors they see the Earth's rate."""
    spec = flown(requirement=[{"error": "position", "limit": "2 km", "rule": "rss"}])
    spec["tests"].pop("rates")
    spec["plan"] = spec["plan"] | {"fixed": {"static": {"temperatures": 3, "repeats": 2}}}
    spec["unit"] = spec["unit"] | ({} if noise is None else {"noise": noise})
    return spec


def estimates(noise: dict[str, str] | None) -> dict[str, float]:
    return {e: a["parts"]["estimate"] for e, a in planned_from(at_rest(noise)).document["allowances"].items()}


def test_plan_simulation_and_verify_have_the_same_noise_of_records() -> None:
    for noise in (None, NOISE, {"gyro": NOISE["gyro"]}, NONE):
        spec = loaded(at_rest(noise)).spec
        of_plan = {s: spec.unit.white_of_records(s) for s in SENSORS}
        assert of_plan == pytest.approx(dict(settings_of(spec).white))
        assert of_plan == pytest.approx(dict(chance_of(spec).white))


def test_what_is_left_out_is_that_of_a_small_unit_on_the_bench() -> None:
    left_out, given = estimates(None), estimates(NOISE)
    assert left_out == pytest.approx(given)
    assert left_out["gyro.scale_factor"] > 1.5 * estimates(NONE)["gyro.scale_factor"]


def test_a_planner_without_noise_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def faults() -> list[str]:
        one = planned_from(at_rest(None))
        options = FlightOptions(flights=0, through_files=0)
        return [
            f.check for f in verify(one.loaded, one.document, options, lambda message: None).recount.faults
        ]

    assert not faults()
    monkeypatch.setattr(Unit, "white_of_records", Unit.white)
    assert "allowances" in faults()
