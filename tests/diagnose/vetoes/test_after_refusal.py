"""What the power-ons leave of several names of a channel is held against the variables once more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.chance import Flips
from planner.diagnose.hypotheses.found import Found, Question
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.search.sensor import _unname_what_is_left, diagnose_sensor
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.unit import campaign, noise_of
from tests.diagnose.worlds import DECLARED


def walked(seed: int) -> DwellTable:
    """The gyros of a campaign, the bias of one walking over the days by 2.5 levels of a power-on a day."""
    table, _ = campaign(seed, centrifuge=False)
    assert table.gyro is not None
    runs, first = np.unique(table.run, return_index=True)
    days = table.day[first]
    order, walk = np.argsort(days, kind="stable"), np.empty(len(runs))
    steps = np.random.default_rng([seed, 3]).normal(size=len(runs))
    walk[order] = np.cumsum(steps * np.sqrt(np.diff(days[order], prepend=0.0)))
    size = np.radians(2.5 * noise_of(seed, "gyro").level)
    gyro = table.gyro.copy()
    gyro[:, seed % 3] += size * walk[np.searchsorted(runs, table.run)]
    return replace(table, gyro=gyro, acc=None)


@pytest.mark.parametrize("seed", [95100])
@pytest.mark.further("seed", [95103])
def test_a_step_that_the_days_explain_better_does_not_stay_by_itself(seed: int) -> None:
    """Beside a hysteresis, refused afterwards, it was better than the days; alone it is not."""
    data, axis = prepared(walked(seed)), seed % 3
    s = diagnose_sensor(data, "gyro", DECLARED, 1)
    pool = s.found.pool
    mine = [i for i, b in enumerate(pool.blocks) if b.channels == (axis,)]
    steps = [i for i in mine if pool.blocks[i].name == "bias_step"]
    best = max(steps, key=lambda i: score(pool, [i]).criterion)
    found = Found(pool, [best], [], p={best: 1e-9})
    generic = tuple(i for i in mine if pool.blocks[i].generic)
    flips = Flips(np.empty((0, len(s.cuts))), False)
    question = Question(tuple(steps), generic, flips, lambda p, believed, i: (p, i), lambda f, i: None)
    _unname_what_is_left(found, question, data.starts)
    assert not found.library
    assert [pool.blocks[u].key for u in found.unknown] == [("day", (axis,))]
    assert found.p[found.unknown[0]] == found.p[best]
