"""An arm that bends, of which a unit that was on it one way only tells arm and fixture together."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.dwells.table_rows import rows_of
from planner.effects._bench_frame import load, upwards
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SPEC = shipped("small_uav").spec


def _one_way(table: DwellTable) -> DwellTable:
    """Without the loads under which a fixture gives way to another side than the arm."""
    conditions = table.conditions()
    about = np.cross(upwards(conditions), load(conditions))
    return rows_of(table, about.min(axis=1) > -1e-6)


@pytest.mark.parametrize("seed", [93041])
@pytest.mark.further("seed", [93040, 93042, 93043])
def test_an_arm_that_bends_stands_by_what_both_parts_are_together(seed: int) -> None:
    """Neither had an interval, nothing of it stood, and an accelerometer had a cross-coupling instead."""
    table, _ = campaign(seed, fault="arm_bending")
    found = diagnose(_one_way(table), SPEC)
    assert {e.effect for e in found.effects} == {"arm_bending"}
    assert not found.unknown
    for e in found.effects:
        (arm,) = (t for t in e.terms if t.name == "arm")
        size = abs(np.degrees(arm.value)) * 9.80665 * 50.0
        assert 0.15 < size < 0.25
        assert not arm.low <= 0.0 <= arm.high
