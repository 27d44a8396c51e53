"""What wanders in one channel does not hide what another one lacks: every block counts by its own chance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.chance import Flips
from planner.diagnose.hypotheses.scores import nulls_of
from planner.diagnose.search.sensor import begin
from planner.nouns.array import Array
from tests.diagnose.hall import Hall, days, hidden, read
from tests.diagnose.worlds import DECLARED, whole

NOISE = 4e-4  # deg/s of a record, by which the bias of one gyro walks from one record to the next


def _walks(hall: Hall, seed: int) -> Array:
    """(n,) a walk within every power-on, from nothing."""
    steps = np.random.default_rng([seed, 9]).normal(size=len(hall.run))
    out = np.zeros(len(steps))
    for i in range(1, len(steps)):
        out[i] = out[i - 1] + steps[i] if hall.run[i] == hall.run[i - 1] else 0.0
    return out


@pytest.mark.parametrize("seed", [351])
@pytest.mark.further("seed", [354, 355, 352, 356])
def test_a_walk_of_one_gyro_does_not_hide_the_warm_up_of_another(seed: int) -> None:
    """At 5 to 8 sigma it was nothing, five times of six: the walk's tables made chance look that large."""
    hall = days(seed, 20)
    table = replace(read(hall, seed), acc=None)
    walks = hidden(table, "gyro", 0, NOISE * _walks(hall, seed))
    found = whole(hidden(walks, "gyro", 1, 6.5e-4 * np.exp(-hall.time_on / 400.0)))
    said = {e.effect for e in found.effects if "gyro_y" in e.channels}
    assert said <= {"warm_up", "drift", "drift_curve", "settling"}
    assert said


@pytest.mark.parametrize("seed", [362])
@pytest.mark.further("seed", [364, 366, 367])
def test_what_wanders_within_power_ons_does_not_hide_a_step_between_them(seed: int) -> None:
    """Of one gyro: the walk's drifts made chance look like eight sigma, and the step was nothing."""
    hall = days(seed, 24)
    walks = hidden(replace(read(hall, seed), acc=None), "gyro", 0, NOISE * _walks(hall, seed))
    found = whole(hidden(walks, "gyro", 0, 3.6e-3 * (hall.run > 12)))
    assert {e.effect for e in found.effects if "gyro_x" in e.channels} & {"bias_step", "ageing"}


@pytest.mark.parametrize("seed", [351, 352, 353])
def test_what_acts_on_three_channels_is_one_test_of_all_that_are_counted(seed: int) -> None:
    """It was one of each: twelve power-ons made more of them than there are, and hid faint effects."""
    begun = begin(prepared(read(days(seed, 12), seed)), "accelerometer", DECLARED)
    blocks = range(len(begun.pool.blocks))
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(99, len(begun.cuts)))
    nulls = nulls_of(begun.pool, blocks, Flips(signs, few_runs=True))
    every = len({begun.pool.blocks[b].key for b in blocks})
    assert all(nulls.of(axes, kind).tests == every for axes in ([0], [0, 1, 2]) for kind in (False, True))
