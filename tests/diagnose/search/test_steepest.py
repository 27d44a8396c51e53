"""A unit that warms itself by two kelvins shows the slope of its curve at every node of a table.

How large that can be is bounded by the table. A chord from end to end of a curve that turns in between is
nothing, the tangent at its end is not: what the warm-up made of it was named, as a hysteresis of 9 sigma.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.channel import _steepest
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from tests.diagnose.hall import FACES, RATES, Hall, Log, hidden, read
from tests.diagnose.worlds import DECLARED, named, unnamed


def _warms_itself(seed: int, power_ons: int = 9) -> Hall:
    """Three temperatures, two of them close together; every power-on warms by 2 K, settling in 15 min."""
    rng, log = np.random.default_rng([seed, 37]), Log()
    for k in range(power_ons):
        log.on(rng.uniform(8.0, 50.0))
        for i in rng.permutation(18):
            degc = [-20.0, 55.0, 66.0][k % 3] + 2.0 * (1.0 - np.exp(-log.t / 900.0))
            if i < 6:
                log.record(*FACES[i], degc)
            else:
                log.record((i - 6) // 4, 1.0, degc, turn=RATES[i % 4])
        log.day += 0.5
    return log.hall()


def test_a_parabola_is_no_steeper_at_its_nodes() -> None:
    nodes = np.array([-20.0, 55.0, 66.0])
    for middle in (-30.0, 0.0, 17.5, 40.0, 60.0, 90.0):
        tangents = np.abs(2.0 * (nodes - middle))
        assert np.all(_steepest(nodes, (nodes - middle) ** 2) >= tangents * (1.0 - 1e-9))
    assert np.all(np.isinf(_steepest(nodes[:1], nodes[:1])))
    assert _steepest(nodes[:2], np.array([1.0, 76.0])) == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize("seed", [1, 3])
@pytest.mark.further("seed", [2, 4, 5])
def test_a_curve_that_turns_between_two_nodes_is_no_effect(seed: int) -> None:
    hall = _warms_itself(seed)
    shape = 0.03 * ((hall.temperature - 17.5) / 37.5) ** 2
    table = hidden(read(hall, seed), "gyro", 0, shape)
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, seed).found
    assert named(found) | unnamed(found) == set()
