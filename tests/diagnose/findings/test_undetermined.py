"""A table of which no record reaches the end: no coefficient of it is told, that it is there is sure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from tests.diagnose.hall import axes_apart, hidden, read
from tests.specs import shipped

SPEC = shipped("small_uav").spec
RATES = (12.0, 40.0, 90.0, 160.0, 270.0, 380.0)  # deg/s; the table's end is 500


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3])
def test_a_dead_band_goes_with_the_rate(seed: int) -> None:
    """Its table of scale factors was believed at 40 sigma, and dropped: "nothing is missing"."""
    hall = axes_apart(seed, turns=(*RATES, *(-r for r in RATES)))
    u = hall.rate[:, 1]
    table = hidden(read(hall, seed), "gyro", 1, -6e-3 * np.clip(u / 25.0, -1.0, 1.0))
    found = diagnose(replace(table, acc=None), SPEC)
    assert not found.effects
    assert [(u.channels, u.varies_with) for u in found.unknown] == [(("gyro_y",), "rate")]
