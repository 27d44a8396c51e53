"""A name stands for what was significant in its place, and for nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.found import ALPHA
from planner.diagnose.search.sensor import diagnose_sensor
from tests.diagnose.hall import GYRO, days, hidden, read
from tests.diagnose.worlds import DECLARED


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, *range(4, 8)])
def test_only_in_the_place_of_what_was_significant_does_a_name_stay(seed: int) -> None:
    """A warm-up with its time constant refined had stood for itself with p = 0.18, and was claimed."""
    hall, axis = days(seed), seed % 3
    shape = 8.0 * GYRO.white * np.exp(-hall.time_on / 200.0)
    table = replace(hidden(read(hall, seed), "gyro", axis, shape), acc=None)
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, 1).found
    (b,) = found.all
    assert found.pool.blocks[b].key == ("warm_up", (axis,))
    weak = replace(found.share(b), log_p=np.log(5e-4))  # of one test: nothing among so many
    for p, stays in ((0.5 * ALPHA, True), (0.18, False)):
        found.stood_for = {found.pool.blocks[b].key: p}
        assert found.may_stay(b, weak) == stays
    found.stood_for = {}
    assert not found.may_stay(b, weak)
