"""Coefficients that hide each other: a size and its time constant, an effect and that of another channel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.findings.reported import sizes_of_a_sign
from tests.diagnose.hall import GYRO, days, hidden, read
from tests.specs import shipped

SPEC = shipped("small_uav").spec
SIZE = 6.0 * GYRO.white


@pytest.mark.parametrize(("seed", "power_ons", "time_constant"), [(98003, 12, 500.0)])
@pytest.mark.further(("seed", "power_ons", "time_constant"), [(98002, 24, 500.0), (98002, 24, 700.0)])
def test_a_settling_and_the_drift_of_another_channel_keep_their_names(
    seed: int, power_ons: int, time_constant: float
) -> None:
    """Both were declared for both, each coefficient then as if it were nothing: no name at 30 sigma."""
    hall = days(seed, power_ons)
    settles = hidden(read(hall, seed), "gyro", 0, SIZE * np.exp(-hall.time_on / time_constant))
    found = diagnose(replace(hidden(settles, "gyro", 1, -SIZE * hall.time_on / 1000.0), acc=None), SPEC)
    assert {(e.effect, e.channels) for e in found.effects} == {
        ("warm_up", ("gyro_x",)),
        ("drift", ("gyro_y",)),
    }
    assert not found.unknown
    for e in found.effects:
        assert all(t.low > 0.0 or t.high < 0.0 for t in e.terms)
    (size,) = (t for e in found.effects if e.effect == "warm_up" for t in e.terms if not t.parameter)
    assert size.low < np.radians(SIZE) < size.high


def test_a_size_of_a_sure_sign_has_an_interval_of_its_order() -> None:
    low, high = sizes_of_a_sign(2.0, -1.0, 5.0, 20.0)
    assert np.sqrt(low * high) == pytest.approx(2.0)
    assert np.log(high / low) == pytest.approx(3.0)
    assert sizes_of_a_sign(-2.0, -5.0, 1.0, 20.0) == (-high, -low)
    assert sizes_of_a_sign(2.0, -1.0, 5.0, 4.0) == (-1.0, 5.0)  # its sign is not sure
    assert sizes_of_a_sign(2.0, 0.5, 3.5, 20.0) == (0.5, 3.5)  # it is told from zero
    assert sizes_of_a_sign(1.0, -9.0, 11.0, 20.0) == (-9.0, 11.0)  # nor is its order
