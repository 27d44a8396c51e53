"""Three days or two: a step has its name, and what differs between them goes with the day, at no hour."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.channel import channel
from planner.diagnose.shapes.generic import generics
from planner.diagnose.shapes.narrow import waves
from tests.diagnose.hall import Hall, days, hidden, read
from tests.diagnose.worlds import DECLARED, told_on_y, whole


def _on(seed: int, count: int) -> Hall:
    """So many days in turn, numbered from 0 without an hour, twelve power-ons or more on each."""
    hall = days(seed, 36)
    return replace(hall, day=np.floor(count * (hall.run - 1) / 36.0))


@pytest.mark.parametrize(("seed", "first"), [(641, 1.0), (642, 2.0)])
@pytest.mark.further(("seed", "first"), [(643, 1.0), (644, 2.0), (645, 1.0)])
def test_a_step_between_any_two_of_three_days_has_its_name(seed: int, first: float) -> None:
    """Between the first two it was an unknown over the days, or an ageing."""
    hall = _on(seed, 3)
    table = hidden(replace(read(hall, seed), acc=None), "gyro", seed % 3, 6e-3 * (hall.day >= first))
    found = whole(table)
    assert {e.effect for e in found.effects} == {"bias_step"}
    assert not found.unknown


@pytest.mark.parametrize("seed", [651])
@pytest.mark.further("seed", [652, 653])
def test_two_days_without_hours_differ_by_the_day(seed: int) -> None:
    """What rounding left of sin 2π·1 was a wave of the hours of the day."""
    hall = _on(seed, 2)
    table = hidden(replace(read(hall, seed), acc=None), "gyro", seed % 3, 6e-3 * hall.day)
    found = whole(table)
    (effect,) = found.effects
    assert effect.effect == "ageing"
    assert "day" in {r.effect for r in effect.rivals}
    assert "time_of_day" not in {r.effect for r in effect.rivals}
    assert not found.unknown


@pytest.mark.parametrize("seed", [669])
@pytest.mark.further("seed", [670, 661, 664, 671])
def test_an_ageing_over_two_days_keeps_its_name_beside_something_else(seed: int) -> None:
    """Bins of two days are the same column: by what rounding left of either the name was lost."""
    hall = replace(_on(seed, 2), day=4.0 * _on(seed, 2).day)
    late = (hall.time_on - hall.time_on.mean()) / np.ptp(hall.time_on)
    table = hidden(read(hall, seed), "accelerometer", 1, 5e-4 * hall.day + 1.2e-4 * hall.up[:, 1] * late)
    assert told_on_y(table, "accelerometer", seed) == ({"ageing"}, {"time_on_and_specific_force"})


@pytest.mark.parametrize("count", [2, 3, 5, 12])
def test_a_wave_has_more_than_two_days_a_cycle(count: int) -> None:
    hall = _on(661, count)
    table = read(hall, 661)
    c = channel("gyro", 0, table.conditions(), np.zeros(len(hall.run)), DECLARED)
    cycles = [1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0]
    assert len(waves(c, table)) == sum(2.0 * k < count for k in cycles)
    assert not [g for g in generics(c, table) if g.varies_with == "time_of_day"]
