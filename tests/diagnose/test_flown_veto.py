"""A name whose compensation leaves the flight worse is taken away; what it follows stays sure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from planner.diagnose.evidence_veto import refused_by_flight
from planner.nouns.diagnosis import FoundEffect, NavigationCost, UnitDiagnosis
from planner.pipelines.diagnosing import _diagnosed
from tests.diagnose.found import found_effect
from tests.diagnose.hall import Noise, days, hidden, read
from tests.specs import shipped


def flown(*effects: FoundEffect, **after: float) -> tuple[UnitDiagnosis, bool]:
    """Each effect costs 10 m if nobody does anything, of a limit of 200 m; after: metres by its name."""

    def cost(e: FoundEffect) -> Sequence[NavigationCost]:
        return [NavigationCost("position", "m", 4.0, after[e.effect], 0.95, "", 10.0, 200.0)]

    found = UnitDiagnosis("u", "explained", effects, (), (), (), (), ())
    return refused_by_flight(found, cost)


WARM = found_effect("warm_up", "gyro_x", 1e-4, 1e-5)
AGED = found_effect("ageing", "gyro_y", 1e-4, 1e-5)


def test_only_the_name_that_makes_the_flight_worse_goes_and_its_variable_stays() -> None:
    found, fell = flown(WARM, AGED, warm_up=15.0, ageing=3.0)
    assert fell
    assert [e.effect for e in found.effects] == ["ageing"]
    assert [(u.channels, u.varies_with) for u in found.unknown] == [(("gyro_x",), "time_on")]
    assert found.verdict == "partly_explained"
    (why,) = found.refused
    assert why.effect == "warm_up"
    assert "10 to 15 m" in why.why


@pytest.mark.parametrize("after", [9.9, 11.9])
def test_a_flight_that_is_better_or_worse_by_less_than_a_plan_notices_takes_no_name(after: float) -> None:
    found, fell = flown(WARM, warm_up=after)
    assert not fell
    assert found.effects == (WARM,)


def test_an_effect_of_the_bench_does_not_fly() -> None:
    arm = found_effect("arm_length", "accelerometer_x", 1e-3, 1e-4)
    assert not flown(arm, arm_length=100.0)[1]


@pytest.mark.parametrize("seed", [98011])
@pytest.mark.further("seed", [98012, 98013])
def test_siblings_that_are_not_told_take_no_name_from_one_that_is(seed: int) -> None:
    """Sensitivity to y's load over temperature costs a metre, what nobody told of x's flies seven."""
    hall, noise = days(seed, 10), Noise(2e-3, 1e-3)
    shape = 1.5 * noise.white * hall.up[:, 1] * (hall.temperature - 20.0) / 40.0
    table = replace(hidden(read(hall, seed, noise), "gyro", 1, shape), acc=None)
    d = _diagnosed(table, shipped("small_uav"), 1, "", lambda _: None, ()).diagnosis
    assert [(e.effect, e.channels) for e in d.found.effects] == [("g_sensitivity_temperature", ("gyro_y",))]
    assert not d.found.unknown
    assert not all(c.helps for c in d.navigation)  # which the report says, and `update` declares nothing
