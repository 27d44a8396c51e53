"""Where only the worst temperature counts, it is found: between nodes fast curves peak sharply."""

from __future__ import annotations

from typing import Any

import pytest

from planner.information import model_of
from planner.pipelines.promise import FlightOptions, verify
from tests.verify.plans import Planned, planned_from
from tests.verify.test_recount_promise import by_hand


def many_nodes(nodes: int) -> dict[str, Any]:
    """Tables of so many nodes, over which only fast cosines are missed."""
    spec = by_hand()
    for sensor in ("gyro", "accelerometer"):
        bias = spec["unit"][sensor]["bias"]
        spec["unit"][sensor]["bias"] = bias | {
            "run_to_run": "1e-6 deg/s" if sensor == "gyro" else "1e-6 g",
            "temperature_residual": bias["temperature_residual"] | {"curve": "cosines"},
        }
    wide = {"limit": "100 km", "temperature": "worst"}
    spec["plan"]["fixed"]["static"] = {"temperatures": nodes, "repeats": 2}
    rules: tuple[Any, ...] = ("rss", {"percentile": "95 %"})
    return spec | {"requirement": [{"error": "up", "rule": rule} | wide for rule in rules]}


def achieved(one: Planned) -> list[float]:
    return [r["achieved"] for r in one.document["requirements"]]


@pytest.mark.parametrize("nodes", [7])
@pytest.mark.further("nodes", [9])
def test_it_is_found_between_nodes(nodes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    one = planned_from(many_nodes(nodes))
    found = verify(one.loaded, one.document, FlightOptions(flights=0, through_files=0), lambda said: None)
    assert found.recount.ok, found.recount.faults[:5]
    monkeypatch.setattr(model_of, "IN_A_PEAK", 40)
    assert achieved(planned_from(many_nodes(nodes))) == pytest.approx(achieved(one), rel=0.01)
