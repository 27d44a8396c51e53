"""A scale factor that scatters by its rate (K table 2.17): simulated, planned, counted again, flown."""

from __future__ import annotations

from typing import Any

import pytest

from planner.verify.experiment import flown_with
from planner.verify.monte_carlo import fly
from planner.verify.outcome import outcomes
from planner.verify.prediction import Prediction
from planner.verify.starts import anywhere
from planner.verify.workers import here
from tests.verify.plans import planned_from
from tests.verify.test_recount_promise import by_hand, faults_in, prediction

TABLE = {"10 deg/s": "0.6 %", "30 deg/s": "0.4 %", "500 deg/s": "0.1 %"}
TURN = {"name": "turn", "duration": "40 s", "sampling_rate": "50 Hz"}


def turning(run_to_run: Any) -> dict[str, Any]:
    """Turns of a few degrees a second in flight, 500 deg/s on the bench; nothing but the gyros' errors."""
    spec = by_hand()
    unit = spec["unit"]
    unit["gyro"]["scale_factor"] = {"systematic": "3 %", "run_to_run": run_to_run, "storage": "0.002 %"}
    unit["gyro"]["bias"] = {"systematic": "0.03 deg/s", "run_to_run": "0.0001 deg/s"}
    unit["noise"] = {"gyro": "0.01 deg/sqrt(h)", "accelerometer": "0.01 m/s/sqrt(h)"}
    spec["plan"]["fixed"] = {test: {"temperatures": 1, "repeats": 2} for test in spec["tests"]}
    return spec | {"trajectory": TURN}


def figures(spec: dict[str, Any]) -> dict[str, float]:
    return {k: v["1"] for k, v in planned_from(spec).document["families"].items()}


@pytest.fixture(scope="module", name="one")
def _one():
    return planned_from(turning(TABLE))


@pytest.fixture(scope="module", name="foreseen")
def _foreseen(one) -> Prediction:
    """By verify's code, which no patch here touches: found once for all tests."""
    return prediction(one)


def test_a_table_of_one_height_is_a_number():
    number, table = (figures(turning(s)) for s in ("0.3 %", dict.fromkeys(TABLE, "0.3 %")))
    assert table == pytest.approx(number, rel=1e-6)


def test_the_flight_scatters_as_at_its_own_rates(one):
    """Between what one number of the slow rates and one of the fast ones would promise."""
    found = one.document["families"]["kink"]["1"]
    assert figures(turning("0.1 %"))["kink"] < 0.8 * found < found < 1.05 * figures(turning("0.6 %"))["kink"]


def test_what_is_promised_is_counted_again_and_flown(one, foreseen):
    p = foreseen
    assert not faults_in(one.document, p)
    flown = flown_with(p.e, anywhere(p.e.spec), "kink")
    tally = fly(flown, 1500, here, lambda message: None)
    for o in outcomes(flown, tally.tally, one.document, p.e.spec):
        assert p.drawn(o.index, "kink", flown.starts) == pytest.approx(o.at_promise, rel=0.06)


def test_a_flight_without_it_is_found(foreseen):
    """The plan of a constant spread of the fast rates, held to the table's spec."""
    wrong = planned_from(turning("0.1 %")).document
    assert "families, kink, requirement 1" in faults_in(wrong, foreseen)
