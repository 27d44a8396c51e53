"""A cubic beside an asymmetry of a gyro: one is odd, one even, and neither is a bend of the other."""

from __future__ import annotations

import numpy as np
import pytest

from planner.nouns.array import Array
from tests.diagnose.hall import Noise, axes_apart, hidden, read
from tests.diagnose.worlds import whole

RATES = (-400.0, -200.0, -50.0, 50.0, 200.0, 400.0)
GYRO = Noise(4e-4, 1e-3, 1e-5)


def _diagnosed(seed: int, shape: str) -> tuple[set[str], set[str]]:
    """Names and variables of gyro x."""
    hall = axes_apart(seed, visits=3, turns=RATES)
    found = whole(hidden(read(hall, seed, gyro=GYRO), "gyro", 0, _shape(shape, hall.rate[:, 0])))
    names = {e.effect for e in found.effects if "gyro_x" in e.channels}
    return names, {u.varies_with for u in found.unknown if "gyro_x" in u.channels}


def _shape(shape: str, u: Array) -> Array:
    if shape == "pair":
        return np.asarray(8e-4 * u * (u / 500.0) ** 2 + 5e-5 * np.abs(u))
    return np.asarray(-4e-7 * np.maximum(u - 100.0, 0.0) ** 2)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4])
def test_a_cubic_and_an_asymmetry_have_their_names(seed: int) -> None:
    """Bins over six rates follow both: they were one curve without a name, at hundreds of sigma."""
    names, variables = _diagnosed(seed, "pair")
    assert names == {"scale_factor_nonlinearity", "scale_factor_asymmetry"}
    assert not variables


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_a_gyro_that_saturates_on_one_side_is_no_such_pair(seed: int) -> None:
    names, variables = _diagnosed(seed, "one side")
    assert not names & {"scale_factor_nonlinearity", "scale_factor_asymmetry"}
    assert names | variables
