"""Plans that rest on smooth tables: agreement of two codes, flights, and faults in one of the two."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import planner.verify.smooth
from planner.information.smooth import Smooth
from planner.information.tables import hats_of
from planner.pipelines.promise import FlightOptions, verify
from planner.verify.experiment import flown_with
from planner.verify.monte_carlo import fly
from planner.verify.nodes import read
from planner.verify.outcome import outcomes
from planner.verify.recount import recount
from planner.verify.starts import anywhere
from planner.verify.workers import here
from tests.verify.plans import Planned, planned_from, sealed_again
from tests.verify.test_recount_promise import by_hand, faults, prediction


def smoothly(family: str | None = None) -> dict[str, Any]:
    """By hand, with smooth tables; family: of all curves, which is four times as quickly judged as all."""
    spec = copy.deepcopy(by_hand())
    for error in (e for sensor in ("gyro", "accelerometer") for e in spec["unit"][sensor].values()):
        if family is not None and "temperature_residual" in error:
            error["temperature_residual"] |= {"curve": family}
    return spec | {"plan": spec["plan"] | {"temperature_estimator": "smooth"}}


@pytest.fixture(scope="module", name="sound")
def _sound() -> Planned:
    return planned_from(smoothly())


@pytest.fixture(scope="module", name="cubic")
def _cubic() -> Planned:
    return planned_from(smoothly("cubic"))


def test_the_plan_agrees_in_all_families(sound: Planned) -> None:
    assert sound.document["temperature_estimator"] == "smooth"
    assert "smooth tables (posterior mean)" in sound.document["proved_of"]
    assert len(sound.document["families"]) == 4
    assert not faults(sound)


def test_units_go_through_files(cubic: Planned) -> None:
    """By `planner calibrate`, which finds the size of the curves in the data, and exports many nodes."""
    options = FlightOptions(flights=200, through_files=2)
    found = verify(cubic.loaded, cubic.document, options, lambda message: None)
    assert found.recount.ok, found.recount.faults[:5]
    assert found.files.checks
    assert found.files.ok, found.files.faults


def test_what_is_foreseen_is_flown(cubic: Planned) -> None:
    """1500 flights: a 95 % quantile is known to 2 %, one sigma, a root mean square to 1.5 %."""
    p = prediction(cubic)
    flown = flown_with(p.e, anywhere(p.e.spec), "cubic")
    tally = fly(flown, 1500, here, lambda message: None)
    assert tally is not None
    for o in outcomes(flown, tally.tally, cubic.document, p.e.spec):
        assert p.drawn(o.index, "cubic", flown.starts) == pytest.approx(o.at_promise, rel=0.06)


def test_a_plan_that_says_another_estimator_is_found(sound: Planned) -> None:
    document = copy.deepcopy(sound.document)
    document["temperature_estimator"] = "lines"
    found = recount(sealed_again(document), sound.loaded, sound.trajectory)
    assert "temperature_estimator" in {f.where for f in found.faults}


def test_straight_lines_in_the_planner_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def lines(self: Smooth, error: Any, degc: Any, nodes: Any, noise: Any) -> Any:
        return np.broadcast_to(hats_of(degc, nodes), (len(noise), len(nodes), len(degc), nodes.shape[1]))

    monkeypatch.setattr(Smooth, "weights", lines)
    assert "families, cubic, requirement 0" in faults(planned_from(smoothly("cubic")))


def test_straight_lines_in_verify_alone(monkeypatch: pytest.MonkeyPatch, cubic: Planned) -> None:
    tables = planner.verify.smooth.Tables
    monkeypatch.setattr(tables, "weights", lambda self, error, degc, nodes, noise: read(degc, nodes))
    assert "families, cubic, requirement 0" in faults(cubic)


def test_the_noise_of_the_nodes_left_out_of_the_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes that err by as much as curves bend: whoever interpolates them is not what calibrate does."""
    spec = smoothly("cubic")
    spec["unit"]["gyro"]["bias"] |= {"run_to_run": "0.02 deg/s"}
    spec["unit"]["accelerometer"]["bias"] |= {"run_to_run": "0.015 g"}
    assert not faults(planned_from(spec))
    whole = Smooth.weights
    monkeypatch.setattr(
        Smooth,
        "weights",
        lambda self, error, degc, nodes, noise: whole(self, error, degc, nodes, 0.0 * noise),
    )
    assert faults(planned_from(spec))
