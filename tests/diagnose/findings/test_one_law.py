"""What three gyros lack over their own rates by one law is the table's, and by three laws it is their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import days, hidden, read
from tests.diagnose.worlds import whole

GYROS = ("gyro_x", "gyro_y", "gyro_z")


def _cut(table: DwellTable, most: float) -> DwellTable:
    """The rates as a column has them that ends at `most` deg/s."""
    assert table.ref_rate is not None
    return replace(table, ref_rate=np.clip(table.ref_rate, -np.radians(most), np.radians(most)))


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [3])
def test_a_column_of_rates_that_ends(seed: int) -> None:
    """A fifth of the highest rate is missing in it; it was a cubic of three gyros at thousands of sigma."""
    found = whole(_cut(read(days(seed, 12), seed), 150.0))
    assert not [e for e in found.effects if e.sensor == "gyro"]
    (rate,) = [s for s in found.reference_suspects if s.hypothesis == "table_rate"]
    assert set(rate.channels) == set(GYROS)
    assert 0.15 < abs(rate.value) < 0.2  # of 150 and of 180: beside a scale factor that has a part of it


@pytest.mark.parametrize("seed", [4])
@pytest.mark.further("seed", [5, 6])
def test_three_cubics_of_their_own(seed: int) -> None:
    hall = days(seed, 12)
    table = read(hall, seed)
    for axis, size in enumerate((1.0, -1.0, 0.5)):
        table = hidden(table, "gyro", axis, 0.5 * size * (hall.turn[:, axis] / 180.0) ** 3)
    found = whole(table)
    assert {c for e in found.effects for c in e.channels} == set(GYROS)
    assert not found.reference_suspects
