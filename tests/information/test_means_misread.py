"""A thermometer that errs moves every channel along the slopes that all units have, and all by as much.

What it makes of them adds up along the flight as the channels' errors do; a second moment for every error by
itself takes it for as likely as its opposite.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from planner.information.in_common import Common
from planner.verify.second_moments import Moment
from tests.information.test_curves_of_several_units import AT, verified
from tests.verify.plans import Planned, planned_from
from tests.verify.test_recount_promise import by_hand


def steep(scale: float, unit: str, seed: int) -> dict[str, Any]:
    """Curves of three units: lines that tables follow, and a hundredth in which they differ."""
    rng = np.random.default_rng(seed)
    return {
        "curve": [
            {f"{t:g} degC": f"{scale * (t / 60.0 + 0.01 * rng.normal()):.6g} {unit}" for t in AT}
            for _ in range(3)
        ]
    }


def misread() -> dict[str, Any]:
    """Both requirements see one component: along one the channels' errors add up, along the other less so."""
    spec = copy.deepcopy(by_hand())
    for sensor, curve in (("gyro", steep(0.1, "deg/s", 1)), ("accelerometer", steep(100.0, "mg", 2))):
        spec["unit"][sensor]["bias"] |= {"temperature_residual": curve}
    bench = spec["benches"]["rate_table"]
    spec["benches"] = spec["benches"] | {"rate_table": bench | {"accuracy": {"temperature": "3 K"}}}
    wide = {"limit": "100 km", "temperature": "flight"}
    north = {"error": "north", "rule": {"percentile": "95 %"}}
    east = {"error": "east", "rule": "rss"}
    return spec | {"requirement": [north | wide, east | wide]}


@pytest.fixture(scope="module", name="plan")
def _plan() -> Planned:
    return planned_from(misread())


def test_what_is_promised_is_what_flies(plan: Planned) -> None:
    found = verified(plan, flights=2000)
    assert found.recount.ok, found.recount.faults[:5]
    for index, flown in enumerate(found.outcomes):  # 2000 flights tell a root mean square to 2 %
        promised = plan.document["requirements"][index]["achieved"]
        assert flown.at_promise == pytest.approx(promised, rel=0.05)


def test_a_plan_that_adds_squares_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Common, "add_misread", lambda common, of_terms: None)
    assert any(f.check == "promise" for f in verified(planned_from(misread())).recount.faults)


def test_a_recount_that_adds_squares_contradicts_the_plan(
    plan: Planned, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Moment, "mean_slopes", lambda moment, degc, around: np.zeros(len(degc)))
    assert any(f.check == "promise" for f in verified(plan).recount.faults)
