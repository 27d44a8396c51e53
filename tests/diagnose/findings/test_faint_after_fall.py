"""What the calibration's fit is not sure of does not come back as its variable, unless that is strong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import SURE, UNSURE, _forget_the_faint
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.diagnosis import Refused
from tests.diagnose.hall import days, hidden, read
from tests.diagnose.worlds import DECLARED


@pytest.mark.parametrize(("seed", "size"), [(1, 2.2e-4), (1, 6e-4), (2, 6e-4)])
def test_a_variable_in_the_place_of_a_fallen_name_is_as_strong_as_one_must_be(seed: int, size: float) -> None:
    """A drift of four sigma that a unit's in-run explains was an unknown over the time (two campaigns)."""
    hall = days(seed, 18)
    table = hidden(replace(read(hall, seed), acc=None), "gyro", 0, size * (hall.time_on > 400.0))
    s = diagnose_sensor(prepared(table), "gyro", DECLARED, seed)
    (unknown,) = s.found.unknown
    strong = np.sqrt(s.found.share(unknown).delta) >= SURE
    assert strong == (size > 5e-4)
    for effect, channel in (("drift", "gyro_y"), ("ageing", "gyro_x")):  # another channel, another variable
        _forget_the_faint([s], [Refused(effect, (channel,), UNSURE)])
        assert s.found.unknown == [unknown]
    _forget_the_faint([s], [Refused("drift", ("gyro_x",), UNSURE)])
    assert s.found.unknown == ([unknown] if strong else [])
