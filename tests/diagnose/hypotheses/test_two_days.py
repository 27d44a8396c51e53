"""Two sessions: what differs between them is an ageing or a step, whether a week or a day lies between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.diagnosis import UnitDiagnosis
from tests.diagnose.hall import days, hidden, read
from tests.diagnose.worlds import whole


def _two_sessions(seed: int, apart: float) -> UnitDiagnosis:
    """Gyros in 24 power-ons, half of them so many days later, of which one has another bias then."""
    hall = days(seed, 24)
    later = hall.run > np.median(hall.run)
    hall = replace(hall, day=apart * later)
    table = replace(read(hall, seed), acc=None)
    return whole(hidden(table, "gyro", seed % 3, 6e-3 * later))


@pytest.mark.parametrize(("seed", "apart"), [(401, 1.0), (402, 7.0)])
@pytest.mark.further(("seed", "apart"), [(403, 1.0), (404, 1.0)])
def test_what_differs_between_two_sessions_has_the_names_that_it_may_be(seed: int, apart: float) -> None:
    """A day apart it had none, and the same a week apart had: the records tell as much of either."""
    (effect,) = _two_sessions(seed, apart).effects
    assert effect.effect == "ageing"
    assert {"bias_step", "day"} <= {r.effect for r in effect.rivals}


def test_within_a_day_it_has_no_name() -> None:
    found = _two_sessions(401, 0.4)
    assert not found.effects
    assert {u.effect for u in found.untestable} >= {"ageing", "bias_step"}
