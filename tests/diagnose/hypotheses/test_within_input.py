"""What an effect can be at most: an input's errors are less than it, and a scale factor's a share of it."""

from __future__ import annotations

import numpy as np
import pytest

from planner import catalog
from planner.diagnose.channels.channel import LARGEST
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.within_input import most_of_terms
from planner.protocols import Sensor
from tests.diagnose.hall import days, read


def _most(name: str, sensor: Sensor) -> tuple[np.ndarray, np.ndarray]:
    """What every term adds at most, and the input, (n, 3) of six faces and turns of 180 deg/s."""
    conditions = read(days(1, 5), 1).conditions()
    effect = catalog.effects()[name]
    terms = tuple(t.name for t in effect.terms(sensor))
    most = most_of_terms(Block(name, sensor, {}, terms), conditions)
    added = np.abs(effect.regressors(sensor, conditions, {})) @ np.array([most[t] for t in terms])
    return added, np.abs(conditions.rate if sensor == "gyro" else conditions.specific_force)


@pytest.mark.parametrize("sensor", ["gyro", "accelerometer"])
@pytest.mark.parametrize("name", ["scale_factor_nonlinearity", "scale_factor_asymmetry"])
def test_a_scale_factors_error_is_a_share_of_the_input(name: str, sensor: Sensor) -> None:
    """A cubic of −0.5 g per g of three accelerometers was said where their reference of gravity changed."""
    added, driven = _most(name, sensor)
    assert float(added.max()) == pytest.approx(LARGEST * float(driven.max()), rel=0.01)


def test_a_g_sensitivity_may_be_all_that_a_gyro_reads() -> None:
    added, driven = _most("g_sensitivity", "gyro")
    assert float(added.max()) == pytest.approx(float(driven.max()), rel=0.01)
