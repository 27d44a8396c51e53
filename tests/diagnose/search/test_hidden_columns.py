"""What has no name is no noise: few rows carry no more than the candidates that have one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.search.sensor import diagnose_sensor
from tests.diagnose.labs.shapes import Hidden
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SPEC = shipped("small_uav").spec
STRENGTH = 20.0


@pytest.mark.parametrize("seed", [70205])
@pytest.mark.further("seed", [70201, 70203])
def test_what_hides_along_a_variable_without_a_name_does_not_count_as_noise(seed: int) -> None:
    """It was judged at 9 to 10 sigma where it was seen at all: the share of the rate in the noise had it."""
    channel = "xyz"[seed % 3]
    table, _ = campaign(seed, Hidden("asymmetry over temperature", f"gyro_{channel}", STRENGTH))
    found = diagnose(replace(table, acc=None), SPEC)
    assert not found.effects
    assert [(u.varies_with, u.channels) for u in found.unknown] == [
        ("temperature_and_rate", (f"gyro_{channel}",))
    ]
    assert found.unknown[0].strength == pytest.approx(STRENGTH, rel=0.25)


@pytest.mark.parametrize("seed", [70204])
@pytest.mark.further("seed", [70200])
def test_an_offset_of_all_turns_goes_with_the_rate(seed: int) -> None:
    """Its hysteresis, with a level of its own in turns, had intervals around zero: "nothing is missing"."""
    channel = f"gyro_{'xyz'[seed % 3]}"
    table, _ = campaign(seed, Hidden("turning or not", channel, STRENGTH))
    found = diagnose(replace(table, acc=None), SPEC)
    assert not found.effects
    assert [(u.varies_with, u.channels) for u in found.unknown] == [("rate", (channel,))]


def test_where_a_name_does_not_stand_in_the_fit_something_else_is_looked_for() -> None:
    table, _ = campaign(70205, Hidden("warm_up", "gyro_x", STRENGTH))
    again = diagnose_sensor(prepared(table), "gyro", tuple(SPEC.effects), 1, (), {("warm_up", 0)}).found
    names = {again.pool.blocks[b].name for b in again.all}
    assert "warm_up" not in names
    assert {axis for b in again.all for axis in again.axes(b)} == {0}
