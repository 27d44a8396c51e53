"""What an arm does to several channels alike is as little a coincidence as a wrong reference."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.pool import given
from planner.diagnose.search.sensor import diagnose_sensor
from planner.diagnose.search.stepwise import _coincidence
from planner.effects._bench_frame import load
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SPEC = shipped("small_uav").spec


@pytest.mark.parametrize("seed", [93062])
@pytest.mark.further("seed", [93061])
def test_one_longer_arm_is_preferred_to_a_step_of_each_channel(seed: int) -> None:
    """An arm .4 % longer became steps of the biases of two accelerometers on the day the loads began."""
    table, _ = campaign(seed)
    assert table.ref_acc is not None
    longer = replace(table, ref_acc=table.ref_acc - 4e-3 * load(table.conditions()))
    s = diagnose_sensor(prepared(longer, SPEC.unit), "accelerometer", tuple(SPEC.effects), 1)
    (arm,) = s.found.library
    blocks = s.found.pool.blocks
    assert blocks[arm].name == "arm_length"
    steps = [next(i for i, b in enumerate(blocks) if b.key == ("bias_step", (a,))) for a in range(3)]
    here = given(s.found.pool, s.found.others(arm))
    assert _coincidence(s.found, arm, steps, here) > 0.0
    assert _coincidence(s.found, steps[0], steps[1:], here) == 0.0
