"""Of six products of rates, or five of forces, one alone is there: the other five are not to hide it."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from tests.diagnose.hall import GYRO, Hall, anywhere, hidden, read
from tests.diagnose.worlds import DECLARED

STRENGTH = 8.0  # sigma of white noise, by one who knows it and which coefficient it is


def _product(hall: Hall, name: str, axis: int) -> np.ndarray:
    """(n,) a product of two inputs, deg/s, clear of a level of each power-on and of the rates at STRENGTH."""
    one, two = axis, (axis + 1) % 3
    shape = {"cross_coupling": hall.rate[:, one] * hall.rate[:, two]}.get(
        name, hall.up[:, one] * hall.up[:, two]
    )
    levels = (hall.run[:, None] == np.unique(hall.run)).astype(float)
    known = np.column_stack([levels, hall.rate])
    clear = shape - known @ np.linalg.lstsq(known, shape, rcond=None)[0]
    return np.asarray(STRENGTH * GYRO.white / np.linalg.norm(clear) * shape)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [4, 2, 3, 5, 6])
@pytest.mark.parametrize("name", ["cross_coupling", "g_product_sensitivity"])
def test_one_product_is_named(name: str, seed: int) -> None:
    hall, axis = anywhere(seed), seed % 3
    table = hidden(read(hall, seed), "gyro", axis, _product(hall, name, axis))
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, 1).found
    assert [found.pool.blocks[b].key for b in found.all] == [(name, (axis,))]
