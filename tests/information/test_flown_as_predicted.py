"""What a campaign promises is what verify's own code flies, family by family."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import pytest
import yaml

from planner.export.json import plan_text
from planner.information.exact import foreseen
from planner.information.model_of import flight_of
from planner.nouns.plan_file import steps_of
from planner.nouns.trajectory import Trajectory
from planner.pipelines.planning import exact_plan
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.load import LoadedSpec, spec_from_bytes
from planner.verify.experiment import experiment
from planner.verify.monte_carlo import fly
from planner.verify.outcome import outcomes
from planner.verify.starts import starts_of
from planner.verify.workers import here
from tests.specs import SHIPPED

FLIGHTS = 800  # an rms is then known to some 2 % (one sigma), a 95 % quantile to 2.5 %
NOISE = {"gyro": "0.1 deg/sqrt(h)", "accelerometer": "0.05 m/s/sqrt(h)"}
CAMPAIGNS = {
    "close_the_loop": {"static": (4, 2), "rates": (2, 2)},
    "helicopter": {"static": (5, 3), "rates": (1, 2)},
}
CASES = [
    ("close_the_loop", "flight", "kink"),
    ("close_the_loop", "range", "cubic"),
]


def by_hand(name: str, **requirement: Any) -> LoadedSpec:
    """A shipped spec with noise, the campaign fixed by hand and limits that it surely meets."""
    spec = yaml.safe_load((SHIPPED / f"{name}.yaml").read_text())
    spec["unit"] |= {"noise": NOISE}
    spec["plan"]["fixed"] = {
        test: {"temperatures": t, "repeats": n} for test, (t, n) in CAMPAIGNS[name].items()
    }
    for wanted in spec["requirement"]:
        limit = "100 deg" if wanted["error"] in ("heading", "attitude") else "100000 m"
        wanted |= {"rule": {"percentile": "95 %"}, "limit": limit} | requirement
    return spec_from_bytes(yaml.safe_dump(spec, allow_unicode=True).encode(), SHIPPED / "by_hand.yaml")


@cache
def planned(name: str, temperature: str) -> tuple[LoadedSpec, Trajectory, dict[str, Any]]:
    loaded = by_hand(name, temperature=temperature)
    document: dict[str, Any] = json.loads(plan_text(exact_plan(loaded)))
    return loaded, trajectory_of(loaded.spec.trajectory, loaded.folder), document


@pytest.mark.parametrize(("name", "temperature", "family"), CASES)
@pytest.mark.further(("name", "temperature", "family"), [("helicopter", "range", "matern")])
def test_flights_are_as_predicted(name: str, temperature: str, family: str) -> None:
    """Within four standard errors of the flights; plan.json says the same as the model."""
    loaded, trajectory, document = planned(name, temperature)
    found = foreseen(flight_of(loaded.spec, trajectory), steps_of(document)).families[family]
    e = experiment(
        document,
        loaded.spec,
        trajectory,
        seed=3,
        starts=starts_of(loaded.spec.requirement[0], loaded.spec),
        family=family,
    )
    tally = fly(e, FLIGHTS, here, lambda message: None)
    assert tally is not None
    for promised, flown in zip(found, outcomes(e, tally.tally, document, loaded.spec), strict=True):
        assert promised == pytest.approx(flown.at_promise, rel=0.09)
    written = [document["families"][family][str(k)] for k in range(len(found))]
    in_units = [x / r["achieved"] for x, r in zip(written, document["requirements"], strict=True)]
    assert max(in_units) <= 1.0 + 1e-9


def test_a_later_flight_and_noisier_sensors_miss_by_more() -> None:
    loaded, trajectory, document = planned("close_the_loop", "range")
    spec = loaded.spec

    def figure(**changes: Any) -> float:
        other = spec.model_copy(update=changes)
        return foreseen(flight_of(other, trajectory), steps_of(document)).largest[0]

    later = figure(flown_after=4.0 * spec.flown_after)
    louder = spec.unit.noise.model_copy(
        update={"accelerometer": 100.0 * (spec.unit.noise.accelerometer or 0.0)}
    )
    noisy = figure(unit=spec.unit.model_copy(update={"noise": louder}))
    assert figure() < later
    assert figure() < noisy
