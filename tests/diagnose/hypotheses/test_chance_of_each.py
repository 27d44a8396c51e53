"""What wanders in one channel does not hide what another one lacks: every block counts by its own chance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.array import Array
from tests.diagnose.hypotheses.hall import Hall, days, hidden, read
from tests.diagnose.hypotheses.worlds import whole

NOISE = 4e-4  # deg/s of a record, by which the bias of one gyro walks from one record to the next


def _walks(hall: Hall, seed: int) -> Array:
    """(n,) a walk within every power-on, from nothing."""
    steps = np.random.default_rng([seed, 9]).normal(size=len(hall.run))
    out = np.zeros(len(steps))
    for i in range(1, len(steps)):
        out[i] = out[i - 1] + steps[i] if hall.run[i] == hall.run[i - 1] else 0.0
    return out


@pytest.mark.parametrize("seed", [351, 354, 355])
@pytest.mark.further("seed", [352, 356])
def test_a_walk_of_one_gyro_does_not_hide_the_warm_up_of_another(seed: int) -> None:
    """At 5 to 8 sigma it was nothing, five times of six: the walk's tables made chance look that large."""
    hall = days(seed, 20)
    table = replace(read(hall, seed), acc=None)
    walks = hidden(table, "gyro", 0, NOISE * _walks(hall, seed))
    found = whole(hidden(walks, "gyro", 1, 6.5e-4 * np.exp(-hall.time_on / 400.0)))
    said = {e.effect for e in found.effects if "gyro_y" in e.channels}
    assert said <= {"warm_up", "drift", "drift_curve", "settling"}
    assert said
