"""What a turn adds to one accelerometer other than by its square is told as the rate, and is no lever arm.

Campaigns of plain NumPy (tests/diagnose/labs). Accelerometers had no alternative over the rate, so that the
bench was blamed for a curve of one channel.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.unit import campaign
from tests.diagnose.worlds import DECLARED

G = 9.80665


def _claims(table: DwellTable, adds: Array) -> set[tuple[str, tuple[int, ...]]]:
    """What is believed of the accelerometers, to which (n, 3) in m/s² are added: names, channels."""
    assert table.acc is not None
    table = replace(table, acc=table.acc + adds)
    found = diagnose_sensor(prepared(table), "accelerometer", DECLARED, 1).found
    return {found.pool.blocks[b].key for b in found.all}


def _campaign(seed: int, centrifuge: bool) -> tuple[DwellTable, Array]:
    """A campaign with nothing hidden, and the rates of its rows (n, 3), rad/s."""
    table, _ = campaign(seed, centrifuge=centrifuge)
    assert table.ref_rate is not None
    return table, table.ref_rate


@pytest.mark.parametrize(("seed", "axis", "centrifuge"), [(73, 2, False)])
@pytest.mark.further(("seed", "axis", "centrifuge"), [(71, 0, False), (72, 1, True)])
def test_a_modulus_of_the_rate_is_no_lever_arm(seed: int, axis: int, centrifuge: bool) -> None:
    table, rate = _campaign(seed, centrifuge)
    adds = 3e-3 * G * np.linalg.norm(rate, axis=1) / np.radians(300.0)
    assert _claims(table, adds[:, None] * np.eye(3)[axis]) == {("rate", (axis,))}


@pytest.mark.parametrize(("seed", "axis", "centrifuge"), [(82, 1, True)])
@pytest.mark.further(("seed", "axis", "centrifuge"), [(81, 0, False), (83, 2, False)])
def test_a_lever_arm_along_one_axis_keeps_its_name(seed: int, axis: int, centrifuge: bool) -> None:
    table, rate = _campaign(seed, centrifuge)
    adds = np.cross(rate, np.cross(rate, 1e-3 * np.eye(3)[axis]))
    assert _claims(table, adds) == {("lever_arm", (0, 1, 2))}
