"""A refusal names the noise of the records where that hides an error, and how much longer they must be."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from planner.errors import InputError
from planner.plan.observable_campaign import refuse_what_no_campaign_observes
from tests.specs import loaded

SPECS = Path(__file__).parents[2] / "requirements_specs"


def noisy(gyro: str, motions: int = 6) -> dict:
    spec = yaml.safe_load((SPECS / "helicopter.yaml").read_text())
    static = spec["tests"]["static"] | {"motions": motions}
    return spec | {
        "unit": spec["unit"] | {"noise": {"gyro": gyro}},
        "tests": spec["tests"] | {"static": static},
    }


def refusal(tree: dict) -> str:
    with pytest.raises(InputError) as found:
        refuse_what_no_campaign_observes(loaded(tree).spec)
    return str(found.value)


def test_it_says_how_much_longer_records_must_be() -> None:
    said = refusal(noisy("20 deg/sqrt(h)"))
    longer = re.search(r"records (\d+) times as long: unit.noise.gyro", said)
    assert longer is not None, said
    times = int(longer.group(1))
    refuse_what_no_campaign_observes(loaded(noisy(f"{20.0 / times**0.5:g} deg/sqrt(h)")).spec)
    refusal(noisy(f"{20.0 / (times / 64.0) ** 0.5:g} deg/sqrt(h)"))  # of other temperatures, 16 times as long


def test_where_attitudes_are_missing_nothing_is_said_of_noise() -> None:
    assert "times as long" not in refusal(noisy("0.3 deg/sqrt(h)", motions=1))
