"""Errors that no test alone tells: planner and recount take their spread from all tests together."""

from __future__ import annotations

import copy
import json
from typing import Any

import pytest
import yaml

from planner.export.json import plan_text
from planner.pipelines.planning import exact_plan
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.load import LoadedSpec, spec_from_bytes
from planner.verify.recount import recount
from tests.specs import SHIPPED

FACES = [
    {"position_2": "0 deg"},
    {"position_2": "90 deg"},
    {"position_1": "90 deg", "position_2": "90 deg"},
]
BY_HAND = {
    "static": {"temperatures": 3, "repeats": 3},
    "tilts": {"temperatures": 3, "repeats": 4},
    "rates": {"temperatures": 1, "repeats": 3},
}


def one_face(**plan: Any) -> LoadedSpec:
    """`static` keeps one face up, `tilts` shows the others and calibrates the gyros alone."""
    spec = yaml.safe_load((SHIPPED / "close_the_loop.yaml").read_text())
    static = spec["tests"]["static"]
    spec["tests"]["static"] = static | {"motions": [FACES[0], FACES[0]]}
    spec["tests"]["tilts"] = static | {"motions": FACES, "calibrates": ["gyro.bias"]}
    spec["requirement"][0]["limit"] = "900 m"
    spec["plan"] |= {"method": "published", **plan}
    return spec_from_bytes(yaml.safe_dump(spec, allow_unicode=True).encode(), SHIPPED / "one_face.yaml")


@pytest.mark.parametrize("plan", [{}, {"fixed": BY_HAND}], ids=["chosen", "by hand"])
def test_a_plan_by_all_tests_together_is_counted_again(plan: dict[str, Any]) -> None:
    loaded = one_face(**plan)
    document = json.loads(plan_text(exact_plan(loaded)))
    trajectory = trajectory_of(loaded.spec.trajectory, loaded.folder)
    found = recount(document, loaded, trajectory)
    assert found.ok, found.faults[:3]
    for share in (0.97, 1.03):
        wrong = copy.deepcopy(document)
        for r in wrong["reasons"]:
            if r["error"] == "accelerometer.scale_factor":
                r["spread"] *= share
        places = [f.where for f in recount(wrong, loaded, trajectory).faults if f.check == "repeats"]
        assert any("accelerometer.scale_factor, spread of all tests together" in place for place in places)
