"""The spread that the planner claims of one repeat is the spread that simulated campaigns show."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest
import yaml

from planner.export.json import plan_text
from planner.pipelines.planning import exact_plan
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.load import spec_from_bytes
from planner.units import unit_factor
from planner.verify.experiment import experiment, units_left
from tests.specs import SHIPPED, loaded
from tests.verify.plans import flown, planned_from

# The root mean square of 300 units × 3 axes × nodes is known to 2 %; the planner leaves out what the chamber
# strays and the days of storage add, and the fit narrows a little by looking at all tests at once.
AGREE = 0.12


def ratios(document: dict, spec, trajectory, units: int = 300) -> dict[str, float]:
    """Error -> rms of its estimates at the nodes over the claimed s/√n."""
    e = experiment(document, spec, trajectory, seed=3)
    left = [units_left(e, number) for number in range(units // 100)]
    claimed: dict[str, dict[float, float]] = {}
    for r in document["reasons"]:
        size = r["spread"] * unit_factor(r["unit"])[0] / np.sqrt(r["repeats"])
        claimed.setdefault(r["error"], {})[round(r["temperature_degc"], 4)] = size
    found = {}
    for i, one in enumerate(left[0]):
        at = np.concatenate([chunk[i].at_nodes for chunk in left])
        sizes = claimed.get(one.name, {})
        nodes = [k for k, t in enumerate(one.nodes_degc) if round(float(t), 4) in sizes]
        if nodes:
            size = np.array([sizes[round(float(one.nodes_degc[k]), 4)] for k in nodes])
            found[one.name] = float(np.sqrt(np.mean((at[:, nodes] / size[None, :, None]) ** 2)))
    return found


@pytest.mark.parametrize("name", ["close_the_loop", "tactical_leg"])
def test_estimates_scatter_as_the_plan_says(name: str) -> None:
    spec = yaml.safe_load((SHIPPED / f"{name}.yaml").read_text())
    spec["plan"]["method"] = "published"
    shipped = spec_from_bytes(yaml.safe_dump(spec, allow_unicode=True).encode(), SHIPPED / f"{name}.yaml")
    document = json.loads(plan_text(exact_plan(shipped)))
    found = ratios(document, shipped.spec, trajectory_of(shipped.spec.trajectory, shipped.folder))
    assert {"gyro.bias", "accelerometer.bias"} <= found.keys()
    assert all(abs(ratio - 1.0) < AGREE for ratio in found.values()), found


def test_noise_of_the_spec_is_in_the_plan_and_in_the_campaigns() -> None:
    """The noise of a poor sensor: a plan that does not know it believes its bias too much."""
    spec = flown()
    spec["plan"] = spec["plan"] | {"quantile": "student"}
    noisy = copy.deepcopy(spec)
    noisy["unit"]["noise"] = {"gyro": "3 deg/sqrt(h)", "accelerometer": "10 mg/sqrt(Hz)"}
    one = planned_from(noisy)
    found = ratios(one.document, one.loaded.spec, one.trajectory)
    assert all(abs(ratio - 1.0) < AGREE for ratio in found.values()), found
    quiet = planned_from(spec)
    blind = ratios(quiet.document, loaded(noisy).spec, one.trajectory)
    assert blind["gyro.bias"] > 1.3
