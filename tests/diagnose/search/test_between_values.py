"""Parameters between two values of the grid: the nearest misses what is strong, and a table explains more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from tests.diagnose.hall import GYRO, days, hidden, read
from tests.diagnose.noise.test_small_campaigns import claims
from tests.diagnose.worlds import DECLARED, rivals_of


@pytest.mark.parametrize(("seed", "tau", "size"), [(97021, 48.0, 60.0), (97023, 153.0, 15.0)])
@pytest.mark.further(
    ("seed", "tau", "size"),
    [
        (97023, 153.0, 60.0),
        (97024, 49.0, 60.0),
        (97025, 44.0, 60.0),
        (97022, 245.0, 60.0),
        (97026, 127.0, 15.0),
    ],
)
def test_a_strong_warm_up_is_no_curve_over_the_time(seed: int, tau: float, size: float) -> None:
    """At 63 to 250 sigma it had been a drift_curve, or what goes with the time, in five of these seven.

    Within a minute it is the settling that it is but for a constant (`effects.settling`).
    """
    hall = days(seed, 24)
    warming = size * GYRO.white * np.exp(-hall.time_on / tau)
    table = hidden(read(hall, seed), "gyro", seed % 3, warming)
    found = diagnose_sensor(prepared(replace(table, acc=None)), "gyro", DECLARED, 1)
    assert claims(found) == [("settling" if tau < 50.0 else "warm_up", (seed % 3,))]
    (b,) = found.found.all
    assert found.found.pool.blocks[b].nonlinear["time_constant"] == pytest.approx(tau, rel=0.1)


@pytest.mark.parametrize("seed", [97021, 97023])
@pytest.mark.further("seed", [97022, 97024, 97025, 97026])
def test_what_has_nearly_settled_by_the_first_record_is_one_curve_with_two_names(seed: int) -> None:
    """Of 32 s with no record before 65 s, which was the shortest that was asked: a table explained more.

    Between 30 and 60 s a warm-up and a settling are the same but for a constant: one is told, the other
    is its rival.
    """
    early = days(seed, 24)
    hall = replace(early, time_on=early.time_on + 30.0)
    warming = 200.0 * GYRO.white * np.exp(-hall.time_on / 32.0)
    table = hidden(read(hall, seed), "gyro", seed % 3, warming)
    found = diagnose_sensor(prepared(replace(table, acc=None)), "gyro", DECLARED, 1)
    ((name, channels),) = claims(found)
    assert channels == (seed % 3,)
    assert {name, *rivals_of(found)} >= {"warm_up", "settling"}
    assert name in {"warm_up", "settling"}
