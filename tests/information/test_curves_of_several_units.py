"""Curves measured on several units have a mean, which all errors and channels of a unit have at once.

What these add to d they add up in length, and in every flight alike; a second moment for every error by
itself takes them for as likely as their opposites.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from planner.information.curves import Curves
from planner.information.model_of import scenarios
from planner.pipelines.promise import FlightOptions, verify
from planner.verify.second_moments import Moment
from tests.specs import loaded
from tests.verify.plans import Planned, planned_from
from tests.verify.test_recount_promise import by_hand

AT = np.array([-60.0, -35.0, -10.0, 15.0, 40.0, 60.0])


def measured(scale: float, unit: str, seed: int) -> dict[str, Any]:
    """Curves of four units whose mean is three times as large as what they differ by."""
    rng, x = np.random.default_rng(seed), (AT + 60.0) / 120.0
    mean = np.sin(2.2 * np.pi * x) + 0.5 * x
    apart = [rng.normal(size=2) @ [np.cos(1.5 * np.pi * x), np.sin(3.0 * np.pi * x)] / 3.0 for _ in range(4)]
    return {
        "curve": [
            {f"{t:g} degC": f"{scale * v:.6g} {unit}" for t, v in zip(AT, mean + one, strict=True)}
            for one in apart
        ]
    }


def in_common(temperature: str = "range", at: str = "end") -> dict[str, Any]:
    """Few nodes, so that what lines miss of the means of both biases decides."""
    spec = by_hand()
    for sensor, curve in (("gyro", measured(0.01, "deg/s", 1)), ("accelerometer", measured(10.0, "mg", 2))):
        spec["unit"][sensor]["bias"] |= {"temperature_residual": curve}
    wide = {"limit": "100 km", "temperature": temperature, "at": at}
    north = {"error": "north", "rule": {"percentile": "95 %"}}  # along which they take off each other
    east = {"error": "east", "rule": "rss"}  # along which they add up
    return spec | {"requirement": [north | wide, east | wide]}


CASES = [("range", "end"), ("worst", "end")]
FURTHER = [("range", "any")]


@cache
def planned(temperature: str, at: str) -> Planned:
    return planned_from(in_common(temperature, at))


def verified(one: Planned, flights: int = 0) -> Any:
    options = FlightOptions(flights=flights, through_files=0)
    return verify(one.loaded, one.document, options, lambda message: None)


def is_found_out(one: Planned) -> bool:
    return any(f.check == "promise" for f in verified(one).recount.faults)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.further("case", FURTHER)
def test_what_is_promised_is_what_flies(case: tuple[str, str]) -> None:
    found = verified(planned(*case), flights=2000)
    assert found.recount.ok, found.recount.faults[:5]
    for index, flown in enumerate(found.outcomes):  # 2000 flights tell a root mean square to 2 %
        promised = planned(*case).document["requirements"][index]["achieved"]
        assert flown.at_promise == pytest.approx(promised, rel=0.05)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.further("case", FURTHER)
def test_a_planner_that_takes_means_for_as_likely_as_their_opposites_is_found_out(
    case: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Curves, "means", lambda curves, degc: {})
    assert is_found_out(planned_from(in_common(*case)))


def test_a_recount_that_does_so_contradicts_the_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Moment, "common", lambda moment, rows, degc: np.zeros(rows.shape[1::-1]))
    assert is_found_out(planned("range", "end"))


def test_the_worst_temperature_is_looked_for_where_curves_were_measured() -> None:
    """Lines miss most at a corner: 5 degC beside it a curve of few nodes can be half as bad."""
    spec = loaded(in_common("worst")).spec
    own_way: Any = None  # only flights at their own temperatures ask for the response
    degc, weights = scenarios(spec, spec.requirement[0], own_way, 16)
    assert weights is None
    assert set(AT) <= set(degc)
