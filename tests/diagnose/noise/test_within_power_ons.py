"""What stays correlated within a power-on is no step of the day, and no hysteresis with a level of turns.

Campaigns of plain NumPy whose clocks go on within a power-on, rests before turns in each. A step of the bias
was laid between two records of one power-on; a direction of temperature took up that turns came later.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner import catalog
from planner.diagnose.channels.channel import channel
from planner.diagnose.channels.parameters import ranges
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.candidates import library_blocks
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Noise, axes_apart, days, hidden, read
from tests.diagnose.worlds import DECLARED, whole


def _table(seed: int) -> DwellTable:
    return read(days(seed), seed, acc=Noise(3e-5, 8e-4, within=2e-4))


def test_steps_of_the_day_lie_between_power_ons() -> None:
    table = _table(21)
    (day,) = ranges(catalog.effects()["bias_step"], table)
    first = np.array([table.day[table.run == r].min() for r in np.unique(table.run)])
    last = np.array([table.day[table.run == r].max() for r in np.unique(table.run)])
    assert len(day.steps)
    assert not np.any((day.steps[:, None] > first) & (day.steps[:, None] < last))


def test_in_one_power_on_of_many_days_they_lie_between_records() -> None:
    table = _table(22)
    one = DwellTable(**{**vars(table), "run": np.ones(len(table), dtype=int)})
    (day,) = ranges(catalog.effects()["bias_step"], one)
    assert len(day.steps) > 30


@pytest.mark.parametrize("seed", [23, 24])
@pytest.mark.further("seed", range(25, 29))
def test_a_bias_that_wanders_within_power_ons_has_no_name(seed: int) -> None:
    found = diagnose_sensor(prepared(_table(seed)), "accelerometer", DECLARED, 1).found
    assert [found.pool.blocks[b].name for b in found.library] == []


def test_turns_have_a_level_beside_the_direction_only_in_power_ons_of_their_own() -> None:
    for hall, apart in ((days(29), False), (axes_apart(29), True)):
        table = prepared(read(hall, 29)).table
        assert table.gyro is not None
        c = channel("gyro", 0, table.conditions(), table.gyro[:, 0], DECLARED, (), None)
        blocks = library_blocks([c], table, DECLARED, "gyro")
        assert any(b.name == "hysteresis" and b.place == 1.0 for b in blocks) == apart


def test_a_step_between_two_days_keeps_its_name() -> None:
    hall = days(30)
    found = whole(hidden(read(hall, 30), "acc", 2, 2e-3 * (hall.run > 20)))
    assert [(e.effect, e.channels) for e in found.effects] == [("bias_step", ("accelerometer_z",))]
