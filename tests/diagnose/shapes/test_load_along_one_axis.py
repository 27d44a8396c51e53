"""A gyro's bias that bends with the load along one axis is told as that load, not as anything else.

Campaigns of plain NumPy with a centrifuge (tests/diagnose/labs). A sensitivity that saturates is a straight
line, roughly: the name was taken, did not hold, gave way to the orientation, which explains a fifth of it,
and that fell as well.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from planner.dwells.table_rows import rows_of
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.shapes import Hidden
from tests.diagnose.labs.unit import campaign
from tests.diagnose.worlds import DECLARED

G = 9.80665


def _few(seed: int) -> DwellTable:
    """Every other power-on of a campaign with a centrifuge."""
    table, _ = campaign(seed)
    runs = np.unique(table.run)
    return rows_of(table, np.isin(table.run, runs[:: 2 if len(table) > 900 else 1]))


def _with(table: DwellTable, shape: Array, axis: int = 1) -> SensorFound:
    """On one gyro, of 2.5e-3 deg/s root mean square on the centrifuge."""
    assert table.gyro is not None
    assert table.ref_acc is not None
    loaded = np.linalg.norm(table.ref_acc, axis=1) > 1.5 * G
    size = np.radians(2.5e-3) / np.sqrt(np.mean(shape[loaded] ** 2))
    gyro = table.gyro + size * shape[:, None] * np.eye(3)[axis]
    return diagnose_sensor(prepared(replace(table, gyro=gyro)), "gyro", DECLARED, 1)


def _claims(s: SensorFound, axis: int = 1) -> set[str]:
    blocks = s.found.pool.blocks
    return {blocks[b].name for b in s.found.all if axis in blocks[b].columns}


@pytest.mark.parametrize("seed", [41])
@pytest.mark.further("seed", [44, 46, 48])
def test_a_bias_that_saturates_with_one_load(seed: int) -> None:
    table = _few(seed)
    assert table.ref_acc is not None
    claims = _claims(_with(table, 6.0 * np.tanh(table.ref_acc[:, seed % 3] / (6.0 * G))))
    assert claims
    assert claims <= {"specific_force", "load_curve"}


@pytest.mark.parametrize("seed", [51])
@pytest.mark.further("seed", [52, 53])
def test_what_is_straight_keeps_its_name(seed: int) -> None:
    table = _few(seed)
    assert table.ref_acc is not None
    assert _claims(_with(table, table.ref_acc @ np.array([0.5, -1.0, 0.7]))) == {"g_sensitivity"}


@pytest.mark.parametrize("seed", [61])
@pytest.mark.further("seed", [62])
def test_a_name_keeps_its_own_variable_where_it_does_not_hold(seed: int) -> None:
    """A lean over temperature of which nobody takes a day for the cause."""
    table, _ = campaign(seed, Hidden("misalignment_temperature", "gyro_y", 20.0))
    claims = _claims(diagnose_sensor(prepared(table), "gyro", DECLARED, 1))
    assert claims <= {"misalignment_temperature", "temperature_and_rate"}
