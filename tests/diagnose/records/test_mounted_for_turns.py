"""A unit that was mounted another way for the turns of the table: the accelerometers' gravity shows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import catalog
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.effects._bench_frame import load, turning
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SPEC = shipped("small_uav").spec
ANGLES = np.radians([0.12, -0.09, 0.1])


def crooked_in_turns(seed: int, arm: bool = False) -> DwellTable:
    """A campaign in which the references of the turns lack three angles, on a centrifuge too or not."""
    table, _ = campaign(seed)
    conditions = table.conditions()
    here = (turning(conditions) & (arm | ~load(conditions).any(axis=1)))[:, None]
    assert table.ref_acc is not None
    wrong = table.ref_acc - np.cross(ANGLES, table.ref_acc)
    return replace(table, ref_acc=np.where(here, wrong, table.ref_acc), gyro=None)


@pytest.mark.parametrize("arm", [False, True])
@pytest.mark.parametrize("seed", [93020])
@pytest.mark.further("seed", [93021, 93022, 93023])
def test_it_is_a_mounting_and_no_effect_of_a_sensor(seed: int, arm: bool) -> None:
    """Steps of the bias, orientations and days were claimed of all three; with an arm a cross-coupling."""
    found = diagnose(crooked_in_turns(seed, arm), SPEC)
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "mounting"
    size = float(np.degrees(np.linalg.norm(ANGLES)))
    assert abs(suspect.value - size) < 0.1 * size
    assert not [e for e in found.effects if not catalog.effects()[e.effect].bench_only]
    assert not found.unknown
